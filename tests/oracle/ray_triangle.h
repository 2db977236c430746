#pragma once
/// Decides exactly whether a ray meets a triangle, and where. Host only; no decision rounds.
///
/// The ray origin + t * direction meets the closed triangle (p0, p1, p2) iff the three signed volumes
///     w0 = det[d, p1 - o, p2 - o],  w1 = det[d, p2 - o, p0 - o],  w2 = det[d, p0 - o, p1 - o]
/// are all >= 0 or all <= 0, their sum is not 0, and tmin <= t <= tmax. The sum is 0 iff the ray is parallel to the
/// triangle's plane or the triangle has no area: a miss. Then u = w1 / sum, v = w2 / sum, t = dot(p0 - o, n) / dot(d,
/// n).
///
/// Each decision is first tried in double with a forward error bound (a filter after Shewchuk 1997); float inputs can
/// neither underflow nor overflow there. Cases that the filter cannot decide are repeated in integers.

#include <hiprt_build/input.h>
#include <hiprt_device/ray.h>
#include <tests/oracle/exact.h>

#include <algorithm>

namespace hiprt::oracle {

using build::Position;

/// The three corners of a triangle in the mesh's order.
struct Corners {
  Position p0, p1, p2;
};

inline bool is_finite(const Position& p) { return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]); }
inline bool is_finite(const Corners& c) { return is_finite(c.p0) && is_finite(c.p1) && is_finite(c.p2); }
/// Whether builders drop a triangle (decision 0002): two corners are the same, or one is not finite.
inline bool is_dropped(const Corners& c) { return !is_finite(c) || c.p0 == c.p1 || c.p1 == c.p2 || c.p2 == c.p0; }
inline Position position(const Vec3& v) { return {v.x, v.y, v.z}; }
inline Vec3 vec3(const Position& p) { return Vec3(p[0], p[1], p[2]); }

/// The ray's tmin as traced: negative counts as 0.
inline float effective_tmin(const Ray& ray) { return ray.tmin < 0.0f ? 0.0f : ray.tmin; }

/// False for rays that miss everything by definition (ray.h).
inline bool is_valid(const Ray& ray) {
  const Position d = position(ray.direction);
  if (!is_finite(position(ray.origin)) || !is_finite(d) || !std::isfinite(ray.tmin)) return false;
  if (d[0] == 0.0f && d[1] == 0.0f && d[2] == 0.0f) return false;
  return effective_tmin(ray) <= ray.tmax;
}

namespace detail {

using Double3 = std::array<double, 3>;

/// A double and a bound of its distance from the exact value.
struct Approx {
  double value;
  double error;
  /// @return -1, 1, or 0 when the sign is not certain.
  int sign() const { return value > error ? 1 : value < -error ? -1 : 0; }
};

inline Double3 to_double(const Position& p) { return {p[0], p[1], p[2]}; }
inline Double3 subtract(const Double3& a, const Double3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

/// det[a, b, c] of vectors whose components carry a relative error of at most 2^-53 each.
/// A term is rounded 8 times: three inputs, two products, a difference and two sums. So the error is at most 8 * 2^-53
/// of the sum of the terms' magnitudes. Twice that covers the second order and the rounding of the bound itself.
inline Approx determinant(const Double3& a, const Double3& b, const Double3& c) {
  const auto term = [&](std::size_t i, std::size_t j, std::size_t k, double& magnitude) {
    const double left = b[j] * c[k], right = b[k] * c[j];
    magnitude += std::abs(a[i]) * (std::abs(left) + std::abs(right));
    return a[i] * (left - right);
  };
  double magnitude = 0.0;
  const double x = term(0, 1, 2, magnitude), y = term(1, 2, 0, magnitude), z = term(2, 0, 1, magnitude);
  return {x + y + z, 0x1p-49 * magnitude};
}

inline Integer3 to_integer(const Position& p) { return {scaled(p[0]), scaled(p[1]), scaled(p[2])}; }

/// The signed volumes and the plane terms as integers, all scaled by 2^(3 * 149).
struct Volumes {
  std::array<Integer, 3> w;
  Integer sum;       ///< dot(d, n) with n = cross(p1 - p0, p2 - p0)
  Integer distance;  ///< dot(p0 - o, n)
};

inline Volumes volumes(const Ray& ray, const Corners& corners) {
  const Integer3 o = to_integer(position(ray.origin)), d = to_integer(position(ray.direction));
  const Integer3 a = difference(to_integer(corners.p0), o), b = difference(to_integer(corners.p1), o),
                 c = difference(to_integer(corners.p2), o);
  Volumes result{{dot(d, cross(b, c)), dot(d, cross(c, a)), dot(d, cross(a, b))}, {}, {}};
  result.sum = result.w[0] + result.w[1] + result.w[2];
  result.distance = dot(a, cross(difference(b, a), difference(c, a)));
  return result;
}

}  // namespace detail

/// Sign of det[direction, a - origin, b - origin], computed in integers only.
inline int edge_sign_exact(const Position& origin, const Position& direction, const Position& a, const Position& b) {
  using namespace detail;
  const Integer3 o = to_integer(origin);
  return sgn(dot(to_integer(direction), cross(difference(to_integer(a), o), difference(to_integer(b), o))));
}

/// The same, filtered.
inline int edge_sign(const Position& origin, const Position& direction, const Position& a, const Position& b) {
  using namespace detail;
  const Double3 o = to_double(origin);
  const int sign = determinant(to_double(direction), subtract(to_double(a), o), subtract(to_double(b), o)).sign();
  return sign != 0 ? sign : edge_sign_exact(origin, direction, a, b);
}

/// Where the ray's line meets the triangle's plane.
struct ExactPoint {
  Rational t, u, v;
};

/// @return t, u, v. @pre the line is not parallel to the plane (plane_sign != 0).
inline ExactPoint exact_point(const Ray& ray, const Corners& corners) {
  const detail::Volumes v = detail::volumes(ray, corners);
  return {quotient(v.distance, v.sum), quotient(v.w[1], v.sum), quotient(v.w[2], v.sum)};
}

/// Sign of dot(direction, cross(p1 - p0, p2 - p0)); 0: parallel, or a triangle without area.
inline int plane_sign(const Ray& ray, const Corners& corners) { return sgn(detail::volumes(ray, corners).sum); }

/// A hit found by decide(): t approximately, with a certain bound.
struct FilteredHit {
  bool hit = false;
  double t = 0.0;
  double t_error = 0.0;
};

namespace detail {

inline FilteredHit decide_exact(const Ray& ray, const Corners& corners) {
  const Volumes v = volumes(ray, corners);
  const int sum = sgn(v.sum);
  if (sum == 0) return {};
  for (const Integer& w : v.w)
    if (sgn(w) * sum < 0) return {};
  const Rational t = quotient(v.distance, v.sum);
  if (t < exact(effective_tmin(ray))) return {};
  if (std::isfinite(ray.tmax) && t > exact(ray.tmax)) return {};
  return {true, t.get_d(), 0x1p-51 * std::abs(t.get_d())};
}

}  // namespace detail

/// The exact decision whether the closed segment [tmin, tmax] of the ray meets the closed triangle.
/// @pre is_valid(ray), is_finite(corners).
inline FilteredHit decide(const Ray& ray, const Corners& corners) {
  using namespace detail;
  const Double3 o = to_double(position(ray.origin)), d = to_double(position(ray.direction));
  const Double3 p0 = to_double(corners.p0), p1 = to_double(corners.p1), p2 = to_double(corners.p2);
  const Double3 a = subtract(p0, o), b = subtract(p1, o), c = subtract(p2, o);
  const Approx w0 = determinant(d, b, c), w1 = determinant(d, c, a), w2 = determinant(d, a, b);
  const int s0 = w0.sign(), s1 = w1.sign(), s2 = w2.sign();
  if (s0 * s1 < 0 || s1 * s2 < 0 || s0 * s2 < 0) return {};
  if (s0 == 0 || s1 == 0 || s2 == 0) return decide_exact(ray, corners);
  const Double3 e1 = subtract(p1, p0), e2 = subtract(p2, p0);
  const Approx distance = determinant(a, e1, e2), sum = determinant(d, e1, e2);
  if (sum.sign() == 0) return decide_exact(ray, corners);
  const double t = distance.value / sum.value;
  // |x/y - X/Y| <= (dx + |x/y| dy) / |Y|, with |Y| >= |y| - dy; twice for the rounding of these lines.
  const double error = 2.0 * (distance.error + std::abs(t) * sum.error) / (std::abs(sum.value) - sum.error);
  const double tmin = effective_tmin(ray), tmax = ray.tmax;
  if (t + error < tmin || t - error > tmax) return {};
  if (t - error < tmin || t + error > tmax) return decide_exact(ray, corners);
  return {true, t, error};
}

/// decide() without the filter.
inline FilteredHit decide_in_integers(const Ray& ray, const Corners& corners) {
  return detail::decide_exact(ray, corners);
}

/// @return -1, 0 or 1: how the exact t of two triangles on one ray compare. @pre both were hit.
inline int compare_t(const Ray& ray, const Corners& a, const Corners& b) {
  const detail::Volumes x = detail::volumes(ray, a), y = detail::volumes(ray, b);
  return cmp(quotient(x.distance, x.sum), quotient(y.distance, y.sum));
}

}  // namespace hiprt::oracle
