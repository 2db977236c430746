#pragma once
/// The surface at a hit: normal and error bound, from the triangle's vertices.

#include <hiprt_device/format/layout.h>
#include <hiprt_device/intersect/candidate.h>
#include <hiprt_device/math/lanes.h>
#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace surface_detail {

/// A power of two with which a float can hold a cross product of differences of floats: these are between 2^-298 and
/// 2^258.
HIPRT_HD HIPRT_FORCE_INLINE double normal_scale(double x, double y, double z) {
  const auto size = [](double a) { return a < 0.0 ? -a : a; };
  double largest = size(x) > size(y) ? size(x) : size(y);
  largest = size(z) > largest ? size(z) : largest;
  return largest < 0x1p-200 ? 0x1p200 : largest < 0x1p-100 ? 0x1p100 : largest >= 0x1p127 ? 0x1p-132 : 1.0;
}

/// cross(edge1, edge2), multiplied by a power of two where a float could not hold it.
template <class Real>
HIPRT_HD HIPRT_FORCE_INLINE BasicVec3<Real> make_normal(const double (&edge1)[3], const double (&edge2)[3]) {
  const double x = difference_of_products(edge1[1], edge2[2], edge1[2], edge2[1]);
  const double y = difference_of_products(edge1[2], edge2[0], edge1[0], edge2[2]);
  const double z = difference_of_products(edge1[0], edge2[1], edge1[1], edge2[0]);
  const double scale = normal_scale(x, y, z);
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

#if HIPRT_AVX2_LANES
namespace surface_detail {

/// The largest of the first three lanes. @pre none is NaN
HIPRT_FORCE_INLINE float largest_of_three(SimdLanes::Float of) {
  using Four = SimdLanes;
  return Four::value(Four::max(of, Four::max(Four::spread<1>(of), Four::spread<2>(of))));
}
/// make_normal() of the triangle a, b, c, in vector registers. The fourth numbers are not used.
HIPRT_FORCE_INLINE Vec3 normal_of(SimdLanes::Float a, SimdLanes::Float b, SimdLanes::Float c) {
  const __m256d low = _mm256_cvtps_pd(a);
  const __m256d edge1 = _mm256_sub_pd(_mm256_cvtps_pd(b), low), edge2 = _mm256_sub_pd(_mm256_cvtps_pd(c), low);
  // The axes y z x and z x y.
  constexpr int kNext = 1 | 2 << 2 | 0 << 4 | 3 << 6, kLast = 2 | 0 << 2 | 1 << 4 | 3 << 6;
  const __m256d next1 = _mm256_permute4x64_pd(edge1, kNext), last1 = _mm256_permute4x64_pd(edge1, kLast);
  const __m256d next2 = _mm256_permute4x64_pd(edge2, kNext), last2 = _mm256_permute4x64_pd(edge2, kLast);
  const __m256d product = _mm256_mul_pd(last1, next2);
  const __m256d cross = _mm256_add_pd(_mm256_fmsub_pd(next1, last2, product), _mm256_fnmadd_pd(last1, next2, product));
  const double scale = normal_scale(cross[0], cross[1], cross[2]);
  const __m128 scaled = _mm256_cvtpd_ps(_mm256_mul_pd(cross, _mm256_set1_pd(scale)));
  return {scaled[0], scaled[1], scaled[2]};
}
/// Normal and error bound of the triangle a, b, c: the results of complete(), in vector registers.
HIPRT_FORCE_INLINE void complete_triangle(Hit& hit, const Vec3& origin, const float (&a)[3], const float (&b)[3],
                                          const float (&c)[3]) {
  using Four = SimdLanes;
  const auto p0 = Four::set(a[0], a[1], a[2], 0.0f), p1 = Four::set(b[0], b[1], b[2], 0.0f),
             p2 = Four::set(c[0], c[1], c[2], 0.0f), from = Four::set(origin.x, origin.y, origin.z, 0.0f);
  const auto far = [&](Four::Float p) { return Four::magnitude(Four::sub(p, from)); };
  const float reach = largest_of_three(Four::max(Four::max(far(p0), far(p1)), far(p2)));
  const float extent =
      largest_of_three(Four::max(Four::max(Four::magnitude(Four::sub(p1, p0)), Four::magnitude(Four::sub(p2, p0))),
                                 Four::magnitude(Four::sub(p2, p1))));
  const float magnitude =
      largest_of_three(Four::max(Four::max(Four::magnitude(p0), Four::magnitude(p1)), Four::magnitude(p2)));
  hit.error = kUnit<float> * fused_multiply_add(20.0f, reach + extent, 4.0f * magnitude);
  hit.normal = normal_of(p0, p1, p2);
}
}  // namespace surface_detail
#endif

/// Normal and error bound from the leaf's vertices.
template <class Layout, class Real>
HIPRT_HD inline void complete(BasicHit<Real>& hit, const BasicRay<Real>& ray, const typename Layout::Leaf& leaf,
                              unsigned triangle) {
  unsigned vertex[3] = {corner_vertex(triangle, 0), corner_vertex(triangle, 1), corner_vertex(triangle, 2)};
  to_mesh_order(vertex, leaf.info.triangle_ids >> (8 * triangle));
#if HIPRT_AVX2_LANES
  if constexpr (std::is_same_v<Real, float>) {
    float corner[3][3];
    for (unsigned k = 0; k < 3; ++k)
      for (unsigned axis = 0; axis < 3; ++axis) corner[k][axis] = Layout::coordinate(leaf, vertex[k], axis);
    return surface_detail::complete_triangle(hit, ray.origin, corner[0], corner[1], corner[2]);
  }
#endif
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
