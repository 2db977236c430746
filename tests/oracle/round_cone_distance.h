#pragma once
/// The distance of a point from a round cone, in long double. It shares nothing with the quadratic forms of
/// ray_round_cone.h: tests compare the two, and measure how far computed points are from the surface.

#include <tests/oracle/ray_round_cone.h>

namespace hiprt::oracle {

using Real = long double;
using Real3 = std::array<Real, 3>;

inline Real3 real3(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }
inline Real3 minus(const Real3& a, const Real3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Real3 plus(const Real3& a, Real s, const Real3& b) {
  return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]};
}
inline Real inner(const Real3& a, const Real3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Real norm(const Real3& a) { return std::sqrt(inner(a, a)); }

/// A point's distance from the surface, negative inside, and the direction in which it grows (length 1).
struct SurfaceDistance {
  Real value;
  Real3 gradient;
};

/// The minimum of |x - center| - radius over the balls of the sweep, which is convex in x. At the minimum the line from
/// the ball's center to x leaves the axis under the cone's angle.
/// @pre finite, not both radii 0; exact to a few units of 2^-63 of |p1 - p0| + |x - p0|.
inline SurfaceDistance distance_to_surface(const LineAndBalls& in, const Real3& x) {
  const Real3 y = minus(x, real3(in.p0)), w = minus(real3(in.p1), real3(in.p0));
  const Real length = norm(w), dr = Real{in.r1} - in.r0;
  Real s = 0;
  if (length <= std::abs(dr)) {
    s = in.r1 > in.r0 ? 1 : 0;
  } else {
    const Real3 axis{w[0] / length, w[1] / length, w[2] / length};
    const Real z = inner(y, axis), rho = norm(plus(y, -z, axis));
    const Real sine = dr / length, cosine = std::sqrt((1 - sine) * (1 + sine));
    s = std::clamp((z + rho * sine / cosine) / length, Real{0}, Real{1});
  }
  const Real3 from = plus(y, -s, w);
  const Real reach = norm(from);
  const Real value = reach - (Real{in.r0} + s * dr);
  if (reach == 0) return {value, {1, 0, 0}};
  return {value, {from[0] / reach, from[1] / reach, from[2] / reach}};
}

}  // namespace hiprt::oracle
