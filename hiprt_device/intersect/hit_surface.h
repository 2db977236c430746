#pragma once
/// The surface at a hit: normal and error bound, from the triangle's vertices.

#include <hiprt_device/format/layout.h>
#include <hiprt_device/intersect/candidate.h>
#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace surface_detail {

/// cross(edge1, edge2), multiplied by a power of two where a float could not hold it.
template <class Real>
HIPRT_HD HIPRT_FORCE_INLINE BasicVec3<Real> make_normal(const double (&edge1)[3], const double (&edge2)[3]) {
  const double x = difference_of_products(edge1[1], edge2[2], edge1[2], edge2[1]);
  const double y = difference_of_products(edge1[2], edge2[0], edge1[0], edge2[2]);
  const double z = difference_of_products(edge1[0], edge2[1], edge1[1], edge2[0]);
  const auto size = [](double a) { return a < 0.0 ? -a : a; };
  double largest = size(x) > size(y) ? size(x) : size(y);
  largest = size(z) > largest ? size(z) : largest;
  // The products of float differences are between 2^-298 and 2^258.
  const double scale = largest < 0x1p-200   ? 0x1p200
                       : largest < 0x1p-100 ? 0x1p100
                       : largest >= 0x1p127 ? 0x1p-132
                                            : 1.0;
  return {static_cast<Real>(x * scale), static_cast<Real>(y * scale), static_cast<Real>(z * scale)};
}

/// Relative rounding error of a number.
template <class Real> inline constexpr Real kUnit = std::numeric_limits<Real>::epsilon() / 2;

/// An error bound as a float. Bounds in double are rounded up.
HIPRT_HD HIPRT_FORCE_INLINE float to_bound(float bound) { return bound; }
HIPRT_HD HIPRT_FORCE_INLINE float to_bound(double bound) {
  constexpr double kMax = std::numeric_limits<float>::max();
  const auto nearest = static_cast<float>((bound < kMax ? bound : kMax) * (1.0 - 0x1p-24));
  // Fused, so that the bits are the same everywhere.
  return fused_multiply_add(nearest, 1.0f + 0x1p-22f, 0x1p-149f);
}

}  // namespace surface_detail

/// Normal and error bound from the leaf's vertices.
template <class Layout, class Real>
HIPRT_HD inline void complete(BasicHit<Real>& hit, const BasicRay<Real>& ray, const typename Layout::Leaf& leaf,
                              unsigned triangle) {
  unsigned vertex[3] = {corner_vertex(triangle, 0), corner_vertex(triangle, 1), corner_vertex(triangle, 2)};
  to_mesh_order(vertex, leaf.info.triangle_ids >> (8 * triangle));
  double edge1[3], edge2[3];
  Real reach = 0, extent = 0, magnitude = 0;
  const auto read = [&](unsigned axis, Real o) {
    const Real a = Layout::coordinate(leaf, vertex[0], axis), b = Layout::coordinate(leaf, vertex[1], axis),
               c = Layout::coordinate(leaf, vertex[2], axis);
    edge1[axis] = static_cast<double>(b) - static_cast<double>(a);
    edge2[axis] = static_cast<double>(c) - static_cast<double>(a);
    reach = max_of(reach, max_of(max_of(absolute(a - o), absolute(b - o)), absolute(c - o)));
    extent = max_of(extent, max_of(max_of(absolute(b - a), absolute(c - a)), absolute(c - b)));
    magnitude = max_of(magnitude, max_of(max_of(absolute(a), absolute(b)), absolute(c)));
  };
  read(0, ray.origin.x);
  read(1, ray.origin.y);
  read(2, ray.origin.z);
  hit.normal = surface_detail::make_normal<Real>(edge1, edge2);
  using surface_detail::kUnit;
  hit.error = surface_detail::to_bound(kUnit<Real> * fused_multiply_add(Real(20), reach + extent, Real(4) * magnitude));
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
