#pragma once
/// Decides exactly whether a line infinitesimally beside this ray passes through a triangle. Concrete numbers stand for
/// the infinitesimals: the origin is off by e, e^2, e^3 with e = 2^-1000, the direction by f, f^2, f^3 with f =
/// 2^-10000. They are so small that they change no nonzero sign of the ray. They are so far apart that no term
/// outweighs a larger one: polynomials of floats are 0 or at least 2^-447, and below 2^400.

#include <tests/oracle/ray_triangle.h>

namespace hiprt::oracle {

/// Which axes the line is off along, most first: those across the ray's longest axis, then that.
inline std::array<unsigned, 3> axes_beside(const Ray& ray) {
  const Position d = position(ray.direction);
  const float x = std::abs(d[0]), y = std::abs(d[1]), z = std::abs(d[2]);
  const unsigned longest = x > y ? (x > z ? 0u : 2u) : (y > z ? 1u : 2u);
  return {(longest + 1) % 3, (longest + 2) % 3, longest};
}

/// @return the sign of det[direction, a - origin, b - origin] for that line; 0 only for a == b.
inline int edge_sign_beside(const Ray& ray, const Position& a, const Position& b) {
  if (const int sign = edge_sign(position(ray.origin), position(ray.direction), a, b); sign != 0) return sign;
  constexpr unsigned kBits = 30000;
  const auto fine = [](const Position& p) {
    Integer3 result = detail::to_integer(p);
    for (Integer& x : result) x <<= kBits;
    return result;
  };
  const std::array<unsigned, 3> axes = axes_beside(ray);
  Integer3 origin = fine(position(ray.origin)), direction = fine(position(ray.direction));
  for (unsigned i = 0; i < 3; ++i) {
    origin[axes[i]] += Integer(1) << (kBits + kFloatScale - 1000 * (i + 1));
    direction[axes[i]] += Integer(1) << (kBits + kFloatScale - 10000 * (i + 1));
  }
  return sgn(dot(direction, cross(difference(fine(a), origin), difference(fine(b), origin))));
}

/// Whether that line, of any t, passes through the triangle.
inline bool passes_beside(const Ray& ray, const Corners& c) {
  const int sign = edge_sign_beside(ray, c.p0, c.p1);
  return sign != 0 && edge_sign_beside(ray, c.p1, c.p2) == sign && edge_sign_beside(ray, c.p2, c.p0) == sign;
}

}  // namespace hiprt::oracle
