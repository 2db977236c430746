#pragma once
/// Generalised winding numbers: how often a mesh encloses a point, also a mesh with holes.
///
/// Jacobson et al., "Robust Inside-Outside Segmentation using Generalized Winding Numbers" (2013). The tree is that of
/// Barill et al., "Fast Winding Numbers for Soups and Clouds" (2018). The error of far parts is not estimated but
/// bounded: docs/proofs/winding-numbers.md.

#include <hiprt_device/format/winding_tree.h>
#include <hiprt_device/query/angle_sum.h>
#include <hiprt_device/query/side.h>

namespace hiprt {

/// A number and how far it may be from the exact one.
struct WindingNumber {
  /// 1 inside and 0 outside of a closed mesh whose triangles are counterclockwise as seen from outside. -1 inside of
  /// one that is turned inside out, 2 inside of two. In between for meshes with holes.
  double value = 0.0;
  double error = 0.0;  ///< The exact number is within this. +inf: it is not known.
};

inline namespace HIPRT_ISA_NAMESPACE {

namespace winding_detail {

/// Covers the rounding of a node's moments and of far_part(), as a share of area / distance^2.
inline constexpr double kMomentRounding = 0x1p-32;
inline constexpr double kPerSphere = 0.07957747154594767;  ///< 1 / (4 pi).
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

HIPRT_HD HIPRT_FORCE_INLINE Vec3D vec(const double (&a)[3]) { return {a[0], a[1], a[2]}; }
HIPRT_HD HIPRT_FORCE_INLINE Vec3D vec(const float (&a)[3]) { return Vec3D(Vec3(a[0], a[1], a[2])); }

/// The first two terms of a part's solid angle as a series in its size.
/// @param to from the point to the center, with its length.
HIPRT_HD HIPRT_FORCE_INLINE double far_part(const WindingNode& node, const Vec3D& to, double distance) {
  using angle_detail::sum_of_products;
  const double(&s)[6] = node.spread;
  const Vec3D straight(s[0] * to.x, s[1] * to.y, s[2] * to.z), crossed(s[3], s[4], s[5]),
      mixed(to.y * to.z, to.z * to.x, to.x * to.y);
  const double turned = fused_multiply_add(2.0, sum_of_products(crossed, mixed), sum_of_products(straight, to));
  const double along = sum_of_products(vec(node.dipole), to) + (s[0] + s[1] + s[2]);
  const double squared = distance * distance;
  return divided(fused_multiply_add(-3.0, divided(turned, squared), along), squared * distance);
}

/// A bound of the terms that far_part() leaves out, and of rounding.
HIPRT_HD HIPRT_FORCE_INLINE double far_error(const WindingNode& node, double distance) {
  const double t = divided(node.radius, distance), left = 1.0 - t;
  const double tail = divided(t * t * fused_multiply_add(-2.0, t, 3.0), left * left);
  return divided(node.area, distance * distance) * (tail + kMomentRounding);
}

HIPRT_HD HIPRT_FORCE_INLINE void add_triangles(AngleSum& sum, const WindingTriangle* triangles, std::uint32_t count,
                                               const Vec3D& point) {
  for (std::uint32_t k = 0; k < count; ++k) {
    const float(&corner)[3][3] = triangles[k].corner;
    sum.add(vec(corner[0]) - point, vec(corner[1]) - point, vec(corner[2]) - point);
  }
}

}  // namespace winding_detail

/// How often a mesh encloses a point.
///
/// Nodes whose center is farther than @p accuracy radii are taken as a whole. The error falls with the square of
/// @p accuracy, the work grows with it. No stack is needed. At points of the surface the number may be anything between
/// those of both sides. Machines and tools give the same bits for the same arrays.
/// @param point coordinates of less than 2^200; else the error is infinite.
/// @param accuracy at least 2; +inf: every triangle counts for itself, and only rounding is left of the error.
HIPRT_HD inline WindingNumber winding_number(const WindingTree& tree, const Vec3D& point, double accuracy = 8.0) {
  if (!(absolute(point.x) + absolute(point.y) + absolute(point.z) < 0x1p200)) return {0.0, winding_detail::kInfinity};
  AngleSum near;
  double far = 0.0, error = 0.0;
  const double radii = max_of(accuracy, 2.0);
  for (std::uint32_t i = 0; i < tree.node_count;) {
    const WindingNode& node = tree.nodes[i];
    const Vec3D to = winding_detail::vec(node.center) - point;
    const double distance = square_root(angle_detail::sum_of_products(to, to));
    const bool is_leaf = node.next == i + 1;
    if (distance > node.radius * radii) {
      far += winding_detail::far_part(node, to, distance);
      error = fused_multiply_add(winding_detail::far_error(node, distance), winding_detail::kPerSphere, error);
      i = node.next;
      continue;
    }
    if (is_leaf) winding_detail::add_triangles(near, tree.triangles + node.first, node.count, point);
    ++i;
  }
  return {fused_multiply_add(far, winding_detail::kPerSphere, near.turns()), near.error() + error};
}

/// Whether the winding number is at least a half. It is refined until its error leaves no doubt.
///
/// For closed meshes that face outwards the result is that of is_inside() of a scene; points inside two of them are
/// inside. For meshes with holes it depends continuously on them. On the surface, and where the exact number is a
/// half within rounding, it is either. A point that is not finite is outside.
HIPRT_HD inline Side is_inside(const WindingTree& tree, const Vec3D& point) {
  using winding_detail::kInfinity;
  for (double accuracy = 4.0;; accuracy = accuracy < 64.0 ? 4.0 * accuracy : kInfinity) {
    const WindingNumber number = winding_number(tree, point, accuracy);
    if (absolute(number.value - 0.5) > number.error || accuracy == kInfinity)
      return number.value >= 0.5 ? Side::kInside : Side::kOutside;
  }
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
