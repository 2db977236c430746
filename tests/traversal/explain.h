#pragma once
/// How far a traced hit is from the exact hit, in units of rounding that a backward error analysis gives.
///
/// Let D be the largest distance of a corner of the triangle from the ray's origin, and eps = 2^-24. A triangle test in
/// float that first rounds p - o moves the corners by a small multiple of eps * D. So
///  - the hit point lies within plane_bound * eps * D of the triangle and of its plane,
///  - the point that u, v name lies within plane_bound * eps * D / cos of the exact one (cos: ray against normal), and
///  - a wrong decision can only be made for rays within edge_bound * eps * D of the triangle's boundary.

#include <hiprt_device/ray.h>
#include <tests/oracle/brute_force.h>

#include <string>

namespace hiprt::checks {

using namespace hiprt::oracle;

inline constexpr double kEpsilon = 0x1p-24;

inline Double3 operator-(const Double3& a, const Double3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Double3 along(const Double3& a, double s, const Double3& b) {
  return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]};
}
inline double dot(const Double3& a, const Double3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Double3 cross(const Double3& a, const Double3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length(const Double3& a) { return std::hypot(a[0], a[1], a[2]); }

/// A triangle seen from the ray's origin, in double: its own rounding is 2^-29 of the units measured.
struct Seen {
  std::array<Double3, 3> corner{};
  Double3 direction{};  ///< Of length 1.
  double stretch = 1;   ///< Length of the ray's direction.
  double unit = 0;      ///< eps * D; at least the spacing of the smallest coordinates, and of points at the smallest t.

  Seen(const Ray& ray, const Corners& c) {
    const Double3 o = oracle::detail::to_double(position(ray.origin)),
                  d = oracle::detail::to_double(position(ray.direction));
    stretch = length(d);
    direction = {d[0] / stretch, d[1] / stretch, d[2] / stretch};
    std::size_t i = 0;
    for (const Position& p : {c.p0, c.p1, c.p2}) {
      corner[i] = oracle::detail::to_double(p) - o;
      unit = std::max({unit, kEpsilon * length(corner[i++]), 0x1p-149, 0x1p-149 * stretch});
    }
  }
};

/// Distance of the ray's line from the segment a b, in the plane across the ray.
inline double distance_to_edge(const Seen& seen, const Double3& a, const Double3& b) {
  const Double3 p = along(a, -dot(a, seen.direction), seen.direction),
                q = along(b, -dot(b, seen.direction), seen.direction);
  const Double3 edge = q - p;
  const double square = dot(edge, edge);
  const double s = square > 0 ? std::clamp(-dot(p, edge) / square, 0.0, 1.0) : 0.0;
  return length(along(p, s, edge));
}

/// Distance of the ray's line from the triangle's boundary, in units of eps * D.
inline double boundary_distance(const Ray& ray, const Corners& c) {
  const Seen seen(ray, c);
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i)
    best = std::min(best, distance_to_edge(seen, seen.corner[i], seen.corner[(i + 1) % 3]));
  return best / seen.unit;
}

/// The point of a triangle that is nearest to the origin (Ericson, Real-Time Collision Detection, 5.1.5).
inline Double3 nearest_point(const Double3& a, const Double3& b, const Double3& c) {
  const Double3 ab = b - a, ac = c - a, bc = c - b, n = cross(ab, ac);
  const double square = dot(n, n);
  if (square > 0 && dot(cross(a, ab), n) >= 0 && dot(cross(b, bc), n) >= 0 && dot(cross(ac, a), n) >= 0)
    return along({0, 0, 0}, dot(a, n) / square, n);
  const auto on_edge = [](const Double3& p, const Double3& edge) {
    const double s = dot(edge, edge);
    return along(p, s > 0 ? std::clamp(-dot(p, edge) / s, 0.0, 1.0) : 0.0, edge);
  };
  Double3 best = on_edge(a, ab);
  for (const Double3& p : {on_edge(a, ac), on_edge(b, bc)})
    if (dot(p, p) < dot(best, best)) best = p;
  return best;
}

/// Distance of the point that t names from the triangle, in units of eps * D.
inline double point_distance(const Ray& ray, const Corners& c, float t) {
  const Seen seen(ray, c);
  std::array<Double3, 3> from = seen.corner;
  for (Double3& corner : from) corner = along(corner, -static_cast<double>(t) * seen.stretch, seen.direction);
  return length(nearest_point(from[0], from[1], from[2])) / seen.unit;
}

/// Errors of a hit on a triangle, in units of eps * D (inside: eps * D / cos).
struct HitError {
  double plane = 0;   ///< Distance of the point at t from the plane.
  double inside = 0;  ///< Distance, within the plane, of the point at u, v from the exact one.
  double t = 0;       ///< |t - exact| of hits at less than 60 degrees from the normal, in ulps of D.
};

/// @pre plane_sign(ray, c) != 0.
inline HitError hit_error(const Ray& ray, const Corners& c, const Hit& hit) {
  const Seen seen(ray, c);
  const ExactPoint truth = exact_point(ray, c);
  const Double3 e1 = seen.corner[1] - seen.corner[0], e2 = seen.corner[2] - seen.corner[0], n = cross(e1, e2);
  const double n_length = length(n), cosine = n_length > 0 ? std::abs(dot(n, seen.direction)) / n_length : 0.0;
  const double dt = absolute_error(hit.t, truth.t) * seen.stretch;
  const double du = Rational(exact(hit.u) - truth.u).get_d(), dv = Rational(exact(hit.v) - truth.v).get_d();
  const double moved = length(along({du * e1[0], du * e1[1], du * e1[2]}, dv, e2));
  return {dt * cosine / seen.unit, moved * cosine / seen.unit, cosine > 0.5 ? dt / (2 * seen.unit) : 0.0};
}

/// The bounds asserted (see above).
struct Bounds {
  double plane;
  double edge;
  double t;  ///< In ulps of D, at less than 60 degrees from the normal.
};
/// The bounds that the traversal tests check and the README states. The measured maxima are printed by test_hits.cpp.
inline constexpr Bounds kBounds{.plane = 6.0, .edge = 4.0, .t = 2.0};

/// What comparing many hits with the exact ones has shown.
struct Comparison {
  std::uint64_t rays = 0, hits = 0;
  std::uint64_t other_primitive = 0, only_float = 0, only_exact = 0;
  HitError worst{};
  double worst_edge = 0;   ///< Of the rays for which the decisions differ, in eps * D.
  double worst_point = 0;  ///< Distance of the point at t from the triangle, in eps * D.
  std::uint64_t unexplained = 0;
  std::string first_unexplained;
};

namespace detail {

inline double plane_distance_allowed(const Ray& ray, const Corners& c, double plane_bound) {
  const Seen seen(ray, c);
  const Double3 n = cross(seen.corner[1] - seen.corner[0], seen.corner[2] - seen.corner[0]);
  const double n_length = length(n), cosine = n_length > 0 ? std::abs(dot(n, seen.direction)) / n_length : 0.0;
  return plane_bound * seen.unit / (cosine * seen.stretch);
}

/// The float decision differs from the exact one, or is about a range end: only near the boundary or the ends.
inline bool may_differ(const Ray& ray, const Corners& c, const Bounds& bounds, Comparison& comparison) {
  if (plane_sign(ray, c) != 0) {
    const double t = exact_point(ray, c).t.get_d(), allowed = plane_distance_allowed(ray, c, bounds.plane);
    if (std::abs(t - effective_tmin(ray)) <= allowed || std::abs(t - ray.tmax) <= allowed) return true;
  }
  const double distance = boundary_distance(ray, c);
  if (!(distance <= bounds.edge)) return false;
  comparison.worst_edge = std::max(comparison.worst_edge, distance);
  return true;
}

inline void keep_worst(HitError& worst, const HitError& error) {
  worst = {std::max(worst.plane, error.plane), std::max(worst.inside, error.inside), std::max(worst.t, error.t)};
}

}  // namespace detail

inline std::string describe(const Ray& ray) {
  char text[320];
  std::snprintf(text, sizeof text, "ray o=(%a,%a,%a) d=(%a,%a,%a) tmin=%a tmax=%a mask=%x", ray.origin.x, ray.origin.y,
                ray.origin.z, ray.direction.x, ray.direction.y, ray.direction.z, ray.tmin, ray.tmax, ray.mask);
  return text;
}

inline std::string describe(const Corners& c) {
  char text[320];
  std::snprintf(text, sizeof text, "triangle (%a,%a,%a) (%a,%a,%a) (%a,%a,%a)", c.p0[0], c.p0[1], c.p0[2], c.p1[0],
                c.p1[1], c.p1[2], c.p2[0], c.p2[1], c.p2[2]);
  return text;
}

inline std::string describe(const Hit& hit) {
  char text[200];
  std::snprintf(text, sizeof text, "hit t=%a u=%a v=%a geometry=%u primitive=%u", hit.t, hit.u, hit.v, hit.geometry,
                hit.primitive);
  return text;
}

/// Whether a traced closest hit is what exact arithmetic says, up to the bounds; counts in @p comparison.
inline bool explained(std::span<const Mesh> meshes, const Ray& ray, const Hit& hit, const ExactClosest& truth,
                      const Bounds& bounds, Comparison& comparison) {
  if (!hit.found() && !truth.found) return true;
  ++comparison.hits;
  const bool same = hit.found() && truth.found && hit.geometry == truth.geometry && hit.primitive == truth.primitive;
  const auto at = [&](std::uint32_t geometry, std::uint32_t primitive) { return corners(meshes[geometry], primitive); };
  if (hit.found()) {
    const Corners c = at(hit.geometry, hit.primitive);
    if (!(hit.t >= effective_tmin(ray) && hit.t <= ray.tmax)) return false;
    if (!decide(ray, c).hit && !detail::may_differ(ray, c, bounds, comparison)) return false;
    const double point = point_distance(ray, c, hit.t);
    if (!(point <= bounds.plane)) return false;
    comparison.worst_point = std::max(comparison.worst_point, point);
    // A triangle no wider than the rounding of its corners has no plane to speak of.
    if (boundary_distance(ray, c) > bounds.edge) {
      const HitError error = hit_error(ray, c, hit);
      if (!(error.plane <= bounds.plane && error.t <= bounds.t)) return false;
      detail::keep_worst(comparison.worst, error);
    }
  }
  if (same) return true;
  comparison.other_primitive += hit.found() && truth.found ? 1 : 0;
  comparison.only_float += truth.found ? 0 : 1;
  comparison.only_exact += hit.found() ? 0 : 1;
  if (!truth.found) return true;
  const Corners c = at(truth.geometry, truth.primitive);
  const double allowed = detail::plane_distance_allowed(ray, c, bounds.plane);
  const double own =
      hit.found() ? detail::plane_distance_allowed(ray, at(hit.geometry, hit.primitive), bounds.plane) : 0;
  if (hit.found() && hit.t <= truth.where.t + truth.where.t_error + allowed + own) return true;
  return detail::may_differ(ray, c, bounds, comparison);
}

/// Adds what another thread has found.
inline void add(Comparison& sum, const Comparison& part) {
  sum.rays += part.rays;
  sum.hits += part.hits;
  sum.other_primitive += part.other_primitive;
  sum.only_float += part.only_float;
  sum.only_exact += part.only_exact;
  detail::keep_worst(sum.worst, part.worst);
  sum.worst_edge = std::max(sum.worst_edge, part.worst_edge);
  sum.worst_point = std::max(sum.worst_point, part.worst_point);
  sum.unexplained += part.unexplained;
  if (sum.first_unexplained.empty()) sum.first_unexplained = part.first_unexplained;
}

/// explained(), with the first failure written down.
inline void compare(std::span<const Mesh> meshes, const Ray& ray, const Hit& hit, const Bounds& bounds,
                    Comparison& comparison) {
  ++comparison.rays;
  const ExactClosest truth = closest(meshes, ray);
  if (explained(meshes, ray, hit, truth, bounds, comparison)) return;
  if (comparison.unexplained++ != 0) return;
  std::string& text = comparison.first_unexplained;
  text = describe(ray) + "\n  " + describe(hit);
  if (hit.found()) text += "\n  traced: " + describe(corners(meshes[hit.geometry], hit.primitive));
  if (!truth.found) return;
  text += "\n  exact: t=" + std::to_string(truth.where.t) + " geometry=" + std::to_string(truth.geometry) +
          " primitive=" + std::to_string(truth.primitive) + "\n  " +
          describe(corners(meshes[truth.geometry], truth.primitive));
}

}  // namespace hiprt::checks
