#pragma once
/// The common part of curved primitives: vectors of doubles, a line's closest approach to a point, hits from
/// crossings.
///
/// Results have the same bits on every processor. The code uses only + - * / sqrt and explicit fused multiply-adds,
/// all correctly rounded (docs/proofs/round-shapes.md). No plain product is an operand of + or -, so a compiler finds
/// nothing to contract.

#include <hiprt_device/format/shape.h>
#include <hiprt_device/intersect/box_test.h>
#include <hiprt_device/primitives/primitive.h>
#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {
namespace primitive_detail {

struct Double3 {
  double x, y, z;
};

template <class Real> HIPRT_HD HIPRT_FORCE_INLINE Double3 widen(const BasicVec3<Real>& a) { return {a.x, a.y, a.z}; }
HIPRT_HD HIPRT_FORCE_INLINE Double3 widen(const float (&a)[3]) { return {a[0], a[1], a[2]}; }
HIPRT_HD HIPRT_FORCE_INLINE Double3 operator-(const Double3& a, const Double3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
HIPRT_HD HIPRT_FORCE_INLINE Double3 operator-(const Double3& a) { return {-a.x, -a.y, -a.z}; }
HIPRT_HD HIPRT_FORCE_INLINE Double3 scaled(double s, const Double3& a) { return {s * a.x, s * a.y, s * a.z}; }
/// from + t * direction, each component rounded once.
HIPRT_HD HIPRT_FORCE_INLINE Double3 along(const Double3& from, double t, const Double3& direction) {
  return {fused_multiply_add(t, direction.x, from.x), fused_multiply_add(t, direction.y, from.y),
          fused_multiply_add(t, direction.z, from.z)};
}
HIPRT_HD HIPRT_FORCE_INLINE double dot(const Double3& a, const Double3& b) {
  return fused_multiply_add(a.x, b.x, fused_multiply_add(a.y, b.y, a.z * b.z));
}
HIPRT_HD HIPRT_FORCE_INLINE Double3 cross(const Double3& a, const Double3& b) {
  return {difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
          difference_of_products(a.x, b.y, a.y, b.x)};
}
HIPRT_HD HIPRT_FORCE_INLINE double larger(double a, double b) { return a > b ? a : b; }
HIPRT_HD HIPRT_FORCE_INLINE double magnitude(double a) { return without_sign(a); }
HIPRT_HD HIPRT_FORCE_INLINE double largest(const Double3& a) {
  return larger(larger(magnitude(a.x), magnitude(a.y)), magnitude(a.z));
}

/// a * b for a later + or -. No compiler may drop the addition of 0, so it finds no product to contract.
HIPRT_HD HIPRT_FORCE_INLINE double multiplied(double a, double b) { return fused_multiply_add(a, b, 0.0); }

/// |a|^2 - b^2 with one relative error of about 2^-53, as if computed in twice the precision (Dot2 of Ogita, Rump,
/// Oishi 2005).
HIPRT_HD HIPRT_FORCE_INLINE double squares_difference(const Double3& a, double b) {
  const double factor[4] = {a.x, a.y, a.z, b};
  double sum = 0.0, rest = 0.0;
  for (int i = 0; i < 4; ++i) {
    const double f = factor[i], g = i == 3 ? -b : f;
    const double product = multiplied(f, g);
    const double next = sum + product, added = next - sum;
    rest += ((sum - (next - added)) + (product - added)) + fused_multiply_add(f, g, -product);
    sum = next;
  }
  return sum + rest;
}

HIPRT_HD HIPRT_FORCE_INLINE bool is_finite(float a) { return absolute(a) <= std::numeric_limits<float>::max(); }
HIPRT_HD HIPRT_FORCE_INLINE bool is_finite(const float (&a)[3]) {
  return is_finite(a[0]) && is_finite(a[1]) && is_finite(a[2]);
}

/// The point of a line that is nearest to another point.
struct Approach {
  double t, rest;       ///< The point is at t + rest, a sum that one double could not hold.
  Double3 offset;       ///< From the other point to the nearest one.
  double discriminant;  ///< radius^2 - |offset|^2: negative iff the line misses the sphere of that radius.
};

/// The nearest point, after Haines et al., Ray Tracing Gems 2019, ch. 7, with one more step.
///
/// offset = from + t * direction is rounded once, relative to its own size, whatever t the division gives. An error of
/// t moves the offset only along the line, and a second step removes that error. So the offset is as accurate as the
/// difference `from`. That difference is exact for floats whose exponents are within 29, however far the origin is.
/// @param from the line's origin minus the point.
/// @param inverse 1 / |direction|^2.
HIPRT_HD HIPRT_FORCE_INLINE Approach approach(const Double3& from, const Double3& direction, double inverse,
                                              double radius) {
  Approach result;
  result.t = multiplied(dot(from, direction), -inverse);
  const Double3 near = along(from, result.t, direction);
  result.rest = multiplied(dot(near, direction), -inverse);
  result.offset = along(near, result.rest, direction);
  result.discriminant = fused_multiply_add(radius, radius, -dot(result.offset, result.offset));
  return result;
}

/// A hit without t and error, before it is rounded.
struct Details {
  Double3 normal;
  double u, v;
};

/// The error bound of a hit.
/// @param size of the primitive, in scene units: crossings are within 2^-46 * size of the surface, before rounding.
/// @param flat length of the primitive's straight lines. A ray that leaves such a line may meet it again at its other
/// end, lower by up to 6 roundings of the length. These are the roundings of the normal here and in spawn.h, and of
/// its product with the direction there.
/// @tparam Real of t.
template <class Real>
HIPRT_HD HIPRT_FORCE_INLINE float error_bound(const Double3& origin, const Double3& direction, double t, double size,
                                              double flat) {
  if constexpr (std::is_same_v<Real, double>) {
    // The line is displaced by up to 2^-52 of the distance to the primitive.
    const double extent = fused_multiply_add(magnitude(t), largest(direction), largest(origin));
    const double bound =
        fused_multiply_add(0x1p-49, extent, fused_multiply_add(0x1p-46, size, multiplied(7.0 * 0x1p-53, flat)));
    return fused_multiply_add(static_cast<float>(bound), 1.0f + 0x1p-22f, 0x1p-149f);
  }
  // In units of 2^-24: t is rounded (reach 1). origin + t * direction is rounded in one step (point 1) or two (reach 1
  // more). The spawned origin is rounded once (point 1). The rest covers the second order and the rounding of the
  // bound.
  const double largest_step = largest(direction);
  const double reach = magnitude(t) * largest_step;
  const double point = largest(along(origin, t, direction));
  const double rounding = fused_multiply_add(2.25, reach, fused_multiply_add(3.0, point, 7.0 * flat));
  // t may be too small for a float's full precision.
  const double underflow = fused_multiply_add(0x1p-148, largest_step, 0x1p-147);
  return static_cast<float>(fused_multiply_add(0x1p-24, rounding, fused_multiply_add(0x1p-46, size, underflow)));
}

/// Reports a crossing if it lies in [tmin, tmax].
///
/// tmin is compared with the unrounded t, so that a crossing behind an origin stays behind it. tmax is compared with
/// the reported t, so that ties between primitives are ties.
/// @param size, flat see error_bound.
/// @param details called for the Details of a crossing that is reported.
/// @return false to stop.
template <class Real, class MakeDetails, class Report>
HIPRT_HD HIPRT_FORCE_INLINE bool report_crossing(const BasicRay<Real>& ray, Real tmin, Real tmax, double t, double size,
                                                 double flat, const MakeDetails& details, Report& report) {
  BasicCustomHit<Real> hit;
  hit.t = static_cast<Real>(t);
  if (!(t >= static_cast<double>(tmin) && hit.t <= tmax && hit.t <= std::numeric_limits<Real>::max())) return true;
  const Details d = details();
  hit.u = static_cast<Real>(d.u);
  hit.v = static_cast<Real>(d.v);
  hit.normal = {static_cast<Real>(d.normal.x), static_cast<Real>(d.normal.y), static_cast<Real>(d.normal.z)};
  // If a ball is lost in the rounding of a far origin, its normal may be lost, too.
  if (!(max_component(hit.normal) > Real(0))) hit.normal = -ray.direction;
  hit.error = error_bound<Real>(widen(ray.origin), widen(ray.direction), t, size, flat);
  return report(static_cast<const BasicCustomHit<Real>&>(hit));
}

/// Reports the crossings of a ball's surface, the entry first.
/// @param set_parameters called with the Details of a crossing, to set u and v; the normal is as long as the radius.
template <class Real, class SetParameters, class Report>
HIPRT_HD HIPRT_FORCE_INLINE bool intersect_ball(const BasicRay<Real>& ray, Real tmin, Real tmax,
                                                const float (&center)[3], float radius,
                                                const SetParameters& set_parameters, Report& report) {
  const Double3 direction = widen(ray.direction);
  const double inverse = 1.0 / dot(direction, direction), r = radius;
  const Approach near = approach(widen(ray.origin) - widen(center), direction, inverse, r);
  if (!(near.discriminant >= 0.0)) return true;
  const double half_chord = square_root(near.discriminant * inverse);
  const auto report_at = [&](double step) {
    return report_crossing(
        ray, tmin, tmax, near.t + (near.rest + step), r, 0.0,
        [&] {
          Details details{along(near.offset, step, direction), 0.0, 0.0};
          set_parameters(details);
          details.normal = scaled(1.0 / r, details.normal);
          return details;
        },
        report);
  };
  return report_at(-half_chord) && report_at(half_chord);
}

using shape_detail::ball_bounds;
using shape_detail::empty_box;

}  // namespace primitive_detail
}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
