#pragma once
/// The point of a round cone's surface that is closest to a point, in double.
///
/// A round cone is the union of the balls around p0 + s w with radius r0 + s dr (round_cone.h). Its signed distance is
/// the minimum over s of |y - s w| - (r0 + s dr), outside and inside. At the minimum the line from the ball's center to
/// y leaves the axis under the cone's angle. So s L = z + rho sigma / c, with z along and rho across the axis.
///
/// Each number is measured from the end of the axis that it is about. So it is as exact as that end is near.
/// docs/proofs/round-shapes.md has the bounds.

#include <hiprt_device/primitives/ball_distance.h>
#include <hiprt_device/primitives/round_cone.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {
namespace primitive_detail {

/// A unit vector across an axis of any length.
HIPRT_HD HIPRT_FORCE_INLINE Double3 across_axis(const Double3& w) {
  const double x = magnitude(w.x), y = magnitude(w.y), z = magnitude(w.z);
  const Double3 least = x <= y && x <= z ? Double3{1, 0, 0} : y <= z ? Double3{0, 1, 0} : Double3{0, 0, 1};
  const Double3 across = cross(w, least);
  return scaled(1.0 / square_root(dot(across, across)), across);
}

/// The axis of a round cone. Neither ball holds the other.
struct ConeAxis {
  Double3 w;
  double length, sigma, c;

  /// @param k |w|^2 - dr^2 > 0
  HIPRT_HD HIPRT_FORCE_INLINE ConeAxis(const Double3& axis, double dr, double k)
      : w(axis), length(square_root(dot(axis, axis))), sigma(dr / length), c(square_root(k) / length) {}

  /// Where a point is, measured from one end.
  struct Place {
    double z, rho;     ///< Along and across the axis.
    Double3 sideways;  ///< y x w: its length is rho * length.
    double foot;       ///< Where its normal of the cone leaves the axis, times c. Behind 0 the end's ball is closest.
  };
  HIPRT_HD HIPRT_FORCE_INLINE Place place(const Double3& y) const {
    Place at;
    at.sideways = cross(y, w);
    at.z = dot(y, w) / length;
    at.rho = square_root(dot(at.sideways, at.sideways)) / length;
    at.foot = fused_multiply_add(at.z, c, multiplied(at.rho, sigma));
    return at;
  }
  /// The point of the mantle that is closest.
  /// @param end from which @p at was measured. @param radius there.
  HIPRT_HD HIPRT_FORCE_INLINE CustomPoint closest(const FromCenter& end, const Place& at) const {
    const Double3 axis = scaled(1.0 / length, w);
    Double3 outward = across_axis(w);
    if (at.rho > 0.0) {
      // cross(w, y x w) is at right angles to the axis even if little but rounding is left of y x w.
      const Double3 across = cross(w, at.sideways);
      outward = scaled(1.0 / square_root(dot(across, across)), across);
    }
    const Double3 normal = along(scaled(-sigma, axis), c, outward);
    const double away = fused_multiply_add(at.rho, c, -fused_multiply_add(at.z, sigma, end.radius)), step = at.foot / c;
    CustomPoint result;
    result.squared = away * away;
    const double radius = larger(fused_multiply_add(sigma, step, end.radius), 0.0);
    result.point = to_vec(along(along(end.center, step, axis), radius, normal));
    return result;
  }
};

/// The closest point of a round curve's surface. u and v are those of its hits.
/// @pre is_valid(a, b)
HIPRT_HD inline CustomPoint closest_on_curve(const Vec3D& point, const ShapePoint& a, const ShapePoint& b) {
  const Double3 w = widen(b.position) - widen(a.position);
  const double dr = static_cast<double>(b.radius) - static_cast<double>(a.radius), k = squares_difference(w, dr);
  const FromCenter from_a(point, a.position, a.radius), from_b(point, b.position, b.radius);
  const auto of_ball = [&](bool is_b, const Double3& outward) HIPRT_FORCE_INLINE_LAMBDA {
    Double3 normal;
    CustomPoint result = (is_b ? from_b : from_a).closest(outward, normal);
    result.u = is_b ? 1.0 : 0.0;
    return result;
  };
  if (!(k > 0.0)) return of_ball(b.radius > a.radius, {0, 0, 1});
  const ConeAxis axis(w, dr, k);
  const ConeAxis::Place at_a = axis.place(from_a.y), at_b = axis.place(from_b.y);
  if (!(at_a.foot > 0.0)) return of_ball(false, -w);
  if (!(at_b.foot < 0.0)) return of_ball(true, w);
  const bool near_b = from_b.length < from_a.length;
  CustomPoint result = axis.closest(near_b ? from_b : from_a, near_b ? at_b : at_a);
  const double reach = axis.c * axis.length, share = (near_b ? at_b.foot : at_a.foot) / reach;
  result.u = clamped(near_b ? 1.0 + share : share, 0.0, 1.0);
  return result;
}

}  // namespace primitive_detail
}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
