#pragma once
/// The point of a triangle that is closest to a point, in double.
///
/// A vertex gives the same bits in all triangles that share it, and so does an edge. So does a face whose corners come
/// in another order. The reason is that the corners are first sorted by their coordinates. A face counts only if the
/// point certainly projects into it, and an edge only if the point certainly projects between its ends. Otherwise the
/// edges or the ends decide. So neighbours agree on what they share. docs/proofs/closest-points.md proves the bound of
/// the distance.

#include <hiprt_device/intersect/candidate.h>
#include <hiprt_device/math/vec.h>

namespace hiprt {

/// The part of a triangle that contains a point. Edge k leads from corner k to corner k + 1 (edge 2 to corner 0).
enum class TriangleFeature : std::uint32_t { kFace, kEdge0, kEdge1, kEdge2, kVertex0, kVertex1, kVertex2 };

inline namespace HIPRT_ISA_NAMESPACE {

/// The closest point of a triangle.
struct TrianglePoint {
  double squared;  ///< Squared distance. A NaN or infinity in the input gives NaN or infinity.
  Vec3D point;
  double u, v;  ///< Weights of the corners 1 and 2, in [0, 1].
  TriangleFeature feature;
};

namespace point_detail {

/// Decisions within this share of the sum of magnitudes are not certain. The proof needs 8 units of 2^-53.
inline constexpr double kUncertain = 0x1p-49;

HIPRT_HD HIPRT_FORCE_INLINE double dot(const Vec3D& a, const Vec3D& b) {
  return fused_multiply_add(a.x, b.x, fused_multiply_add(a.y, b.y, a.z * b.z));
}
HIPRT_HD HIPRT_FORCE_INLINE Vec3D cross(const Vec3D& a, const Vec3D& b) {
  return {difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
          difference_of_products(a.x, b.y, a.y, b.x)};
}
/// The sum of the magnitudes: at least the length.
HIPRT_HD HIPRT_FORCE_INLINE double size(const Vec3D& a) { return absolute(a.x) + absolute(a.y) + absolute(a.z); }
HIPRT_HD HIPRT_FORCE_INLINE Vec3D along(const Vec3D& from, double share, const Vec3D& direction) {
  return {fused_multiply_add(share, direction.x, from.x), fused_multiply_add(share, direction.y, from.y),
          fused_multiply_add(share, direction.z, from.z)};
}

/// A corner and its number in the mesh.
struct Corner {
  Vec3D at;
  unsigned number;
};

HIPRT_HD HIPRT_FORCE_INLINE Vec3D pick(bool first, const Vec3D& a, const Vec3D& b) {
  return {choose(first, a.x, b.x), choose(first, a.y, b.y), choose(first, a.z, b.z)};
}
HIPRT_HD HIPRT_FORCE_INLINE Corner pick(bool first, const Corner& a, const Corner& b) {
  return {pick(first, a.at, b.at), choose(first, a.number, b.number)};
}

HIPRT_HD HIPRT_FORCE_INLINE void sort(Corner& a, Corner& b) {
  const bool swap = b.at.x != a.at.x ? b.at.x < a.at.x : b.at.y != a.at.y ? b.at.y < a.at.y : b.at.z < a.at.z;
  const Corner low = pick(swap, b, a);
  b = pick(swap, a, b);
  a = low;
}

/// Weights by the numbers of corners.
HIPRT_HD HIPRT_FORCE_INLINE void set_weights(TrianglePoint& result, unsigned first, double of_first, unsigned second,
                                             double of_second) {
  result.u = first == 1 ? of_first : second == 1 ? of_second : 0.0;
  result.v = first == 2 ? of_first : second == 2 ? of_second : 0.0;
}

HIPRT_HD HIPRT_FORCE_INLINE double share(double part, double whole) {
  const double quotient = divided(part, whole);
  return quotient < 1.0 ? quotient : 1.0;
}

HIPRT_HD HIPRT_FORCE_INLINE void take_vertex(TrianglePoint& best, const Corner& corner, double squared) {
  if (!(squared < best.squared)) return;
  const double is_one = corner.number == 1 ? 1.0 : 0.0, is_two = corner.number == 2 ? 1.0 : 0.0;
  best = {squared, corner.at, is_one, is_two,
          static_cast<TriangleFeature>(static_cast<unsigned>(TriangleFeature::kVertex0) + corner.number)};
}

/// @param from, to the point seen from the ends of the edge.
HIPRT_HD HIPRT_FORCE_INLINE void take_edge(TrianglePoint& best, const Corner& a, const Corner& b, const Vec3D& from,
                                           const Vec3D& to) {
  const Vec3D edge = b.at - a.at;
  const double ahead = dot(edge, from), behind = -dot(edge, to), unsure = kUncertain * size(edge);
  if (!(ahead > unsure * size(from) && behind > unsure * size(to))) return;
  const Vec3D across = cross(edge, from);
  const double length = dot(edge, edge), squared = divided(dot(across, across), length);
  if (!(squared < best.squared)) return;
  const double weight = share(ahead, length);
  best.squared = squared;
  best.point = along(a.at, weight, edge);
  set_weights(best, a.number, 1.0 - weight, b.number, weight);
  const unsigned sum = a.number + b.number;  // Of corners 0 and 1, 1 and 2, 0 and 2.
  best.feature = sum == 1 ? TriangleFeature::kEdge0 : sum == 3 ? TriangleFeature::kEdge1 : TriangleFeature::kEdge2;
}

/// @param base the corner opposite the longest edge. So the weight of each corner is as exact as its distance from the
/// opposite edge. @param from the point seen from there.
/// @return whether the point certainly projects into the face.
HIPRT_HD HIPRT_FORCE_INLINE bool take_face(TrianglePoint& best, const Vec3D& point, const Corner& base, const Corner& a,
                                           const Corner& b, const Vec3D& from) {
  const Vec3D edge_a = a.at - base.at, edge_b = b.at - base.at;
  const Vec3D normal = cross(edge_a, edge_b);
  const double whole = dot(normal, normal), unsure = kUncertain * size(normal);
  const double of_b = dot(normal, cross(edge_a, from)), of_a = dot(normal, cross(from, edge_b));
  const double size_a = size(edge_a), size_b = size(edge_b), far = size(from);
  const double of_base = (whole - of_a) - of_b, largest = max_of(size_a, size_b);
  if (!(of_a > unsure * size_b * far && of_b > unsure * size_a * far &&
        of_base > 2.0 * unsure * largest * (far + largest)))
    return false;
  const double height = dot(normal, from), steps = divided(height, whole);
  best.squared = divided(height * height, whole);
  best.point = along(point, -steps, normal);
  set_weights(best, a.number, share(of_a, whole), b.number, share(of_b, whole));
  if (base.number != 0) {
    const double rest = share(of_base, whole);
    best.u = base.number == 1 ? rest : best.u;
    best.v = base.number == 2 ? rest : best.v;
  }
  best.feature = TriangleFeature::kFace;
  return true;
}

}  // namespace point_detail

/// @param corner in the mesh's order.
HIPRT_HD inline TrianglePoint closest_on_triangle(const Vec3D (&corner)[3], const Vec3D& point) {
  using namespace point_detail;
  Corner a{corner[0], 0}, b{corner[1], 1}, c{corner[2], 2};
  sort(a, b);
  sort(b, c);
  sort(a, b);
  const Vec3D from_a = point - a.at, from_b = point - b.at, from_c = point - c.at;
  TrianglePoint best{std::numeric_limits<double>::infinity(), point, 0.0, 0.0, TriangleFeature::kFace};
  const Vec3D ab = b.at - a.at, ac = c.at - a.at, bc = c.at - b.at;
  // Behind both edges of a corner the corner is closest. Far from a mesh most points are.
  const bool is_a = dot(ab, from_a) <= 0.0 && dot(ac, from_a) <= 0.0;
  const bool is_b = !is_a && dot(ab, from_b) >= 0.0 && dot(bc, from_b) <= 0.0;
  if (is_a || is_b || (dot(ac, from_c) >= 0.0 && dot(bc, from_c) >= 0.0)) {
    const Vec3D from = pick(is_a, from_a, pick(is_b, from_b, from_c));
    take_vertex(best, pick(is_a, a, pick(is_b, b, c)), dot(from, from));
    return best;
  }
  const double length_ab = dot(ab, ab), length_ac = dot(ac, ac), length_bc = dot(bc, bc);
  const bool is_bc = length_bc >= length_ab && length_bc >= length_ac, is_ac = !is_bc && length_ac >= length_ab;
  const Corner base = pick(is_bc, a, pick(is_ac, b, c));
  const Vec3D from_base = pick(is_bc, from_a, pick(is_ac, from_b, from_c));
  if (take_face(best, point, base, pick(is_bc, b, a), pick(is_bc || is_ac, c, b), from_base)) return best;
  take_vertex(best, a, dot(from_a, from_a));
  take_vertex(best, b, dot(from_b, from_b));
  take_vertex(best, c, dot(from_c, from_c));
  take_edge(best, a, b, from_a, from_b);
  take_edge(best, a, c, from_a, from_c);
  take_edge(best, b, c, from_b, from_c);
  return best;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
