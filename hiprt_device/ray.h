#pragma once
/// Rays and hits.

#include <hiprt_device/format/node.h>
#include <hiprt_device/math/vec.h>

namespace hiprt {

/// The points origin + t * direction with tmin <= t <= tmax. t is in units of the direction's length.
///
/// - direction: any length; the library does not normalise it. Components may be 0 or -0.
/// - tmin, tmax: both ends belong to the ray. A negative tmin counts as 0. tmax may be +inf.
/// - A ray misses everything if a number is not finite (except tmax), the direction is zero, or tmin > tmax.
/// - Guarantees (docs/decisions/0003-conservative-boxes.md) need the following ranges. The largest coordinate of scene
///   bounds and origin is in [2^-100, 2^60]. The largest direction component is in [2^-100, 2^126]. Their ratio is in
///   [2^-100, 2^90].
/// - A hit whose t is beyond the largest float is a miss.
///
/// @tparam Real float; or double for queries whose policies are DoubleRays (double_rays.h, which has another range).
template <class Real> struct BasicRay {
  BasicVec3<Real> origin{0};
  Real tmin = 0;
  BasicVec3<Real> direction{0, 0, 1};
  Real tmax = std::numeric_limits<Real>::infinity();
  std::uint32_t mask = 0xffffffffu;  ///< The ray sees the geometries with (mask & geometry mask) != 0.
  float time = 0.0f;                 ///< Time, for scenes that move, in the units of their keys. Any number.
};
using Ray = BasicRay<float>;
using RayD = BasicRay<double>;

inline namespace HIPRT_ISA_NAMESPACE {

/// The same ray in another precision. Conversion to float rounds.
template <class To, class From> HIPRT_HD inline BasicRay<To> convert(const BasicRay<From>& ray) {
  const auto number = [](From x) -> To {
    if constexpr (sizeof(To) == sizeof(From)) return x;
    return static_cast<To>(nearest_float(x));
  };
  const auto vector = [&](const BasicVec3<From>& v) { return BasicVec3<To>(number(v.x), number(v.y), number(v.z)); };
  return {vector(ray.origin), number(ray.tmin), vector(ray.direction), number(ray.tmax), ray.mask, ray.time};
}

}  // namespace HIPRT_ISA_NAMESPACE

/// The result of a closest-hit query.
///
/// Of hits at the same t the query reports that of the lowest geometry, then that of the lowest primitive number. So
/// hits do not depend on the tree, its builder or its layout.
template <class Real> struct BasicHit {
  Real t = std::numeric_limits<Real>::infinity();  ///< +inf: a miss. NaN: see failed().
  Real u = 0;  ///< Weight of the triangle's corner 1; the point is (1 - u - v) * p0 + u * p1 + v * p2.
  Real v = 0;  ///< Weight of the triangle's corner 2.
  std::uint32_t geometry = kInvalidId;
  std::uint32_t primitive = kInvalidId;  ///< Within the geometry.
  /// cross(p1 - p0, p2 - p0): not normalised, its length is 2 * area. If its largest component is not in [2^-100,
  /// 2^127), the normal is multiplied by a power of two. A float could not hold it otherwise, or not to the last bit.
  BasicVec3<Real> normal{Real(0)};
  /// Bound, in scene units and per axis, of the distance between the computed point origin + t * direction and the
  /// triangle. It includes the rounding of a ray that starts there (spawn.h).
  float error = 0.0f;

  HIPRT_HD bool found() const { return primitive != kInvalidId; }
  /// Whether the query failed: it is not known whether there is a hit. The policies do not cover the scene (covers()),
  /// or the stack was too small.
  HIPRT_HD bool failed() const { return t != t; }
};
using Hit = BasicHit<float>;
using HitD = BasicHit<double>;

}  // namespace hiprt
