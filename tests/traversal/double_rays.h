#pragma once
/// Shared by the tests of double rays: tracers for every layout, rays, and exact results (GMP rationals).

#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_device/query/double_rays.h>
#include <hiprt_device/query/query.h>
#include <tests/oracle/probe.h>
#include <tests/oracle/random.h>
#include <tests/traversal/scenes.h>

#include <tests/catch.h>

#include <cstdio>

namespace hiprt::checks {

inline constexpr std::uint64_t kDoubleSeed = 20261123;
inline constexpr double kDoubleUnit = 0x1p-53;

template <class LayoutType> struct Far : DoubleRays<WithLayout<LayoutType>> {};
template <class LayoutType> struct FarEveryBox : DoubleRays<WithLayout<LayoutType>> { using Boxes = oracle::EveryBox; };

/// call(policies) for the scene's layout.
template <template <class> class P, class Call> auto with_layout(const SceneView& scene, Call&& call) {
  return dispatch_layout(scene.layout, [&](auto layout) { return call(P<decltype(layout)>{}); });
}
inline HitD closest(const SceneView& scene, const RayD& ray) {
  return with_layout<Far>(scene, [&](auto p) { return closest_hit<decltype(p)>(scene, ray); });
}
inline bool any(const SceneView& scene, const RayD& ray) {
  return with_layout<Far>(scene, [&](auto p) { return any_hit<decltype(p)>(scene, ray); }).found();
}
inline HitD closest_of_every_box(const SceneView& scene, const RayD& ray) {
  return with_layout<FarEveryBox>(scene, [&](auto p) { return closest_hit<decltype(p)>(scene, ray); });
}

inline Vec3D vec(const Double3& v) { return {v[0], v[1], v[2]}; }
inline Vec3D vec(const Position& p) { return {p[0], p[1], p[2]}; }

inline std::string describe(const RayD& ray) {
  char text[240];
  std::snprintf(text, sizeof text, "origin %a %a %a direction %a %a %a", ray.origin.x, ray.origin.y, ray.origin.z,
                ray.direction.x, ray.direction.y, ray.direction.z);
  return text;
}

using Rational3 = std::array<Rational, 3>;
inline Rational3 exact(const Vec3D& v) { return {Rational(v.x), Rational(v.y), Rational(v.z)}; }
inline Rational3 minus(const Rational3& a, const Rational3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Rational3 cross(const Rational3& a, const Rational3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Rational dot(const Rational3& a, const Rational3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Where the ray's line meets a triangle's plane, exactly; inside: the triangle.
struct Met {
  bool inside = false;
  Rational t, u, v;
};
inline Met meet(const RayD& ray, const Corners& c) {
  const Rational3 o = exact(ray.origin), d = exact(ray.direction);
  const Rational3 p0 = minus(exact(vec(c.p0)), o), p1 = minus(exact(vec(c.p1)), o), p2 = minus(exact(vec(c.p2)), o);
  const Rational w0 = dot(d, cross(p1, p2)), w1 = dot(d, cross(p2, p0)), w2 = dot(d, cross(p0, p1));
  const Rational sum = w0 + w1 + w2;
  if (sum == 0) return {};
  Met met;
  met.u = w1 / sum;
  met.v = w2 / sum;
  met.t = dot(p0, cross(minus(p1, p0), minus(p2, p0))) / sum;
  met.inside = met.u >= 0 && met.v >= 0 && met.u + met.v <= 1;
  return met;
}

inline double off(double value, const Rational& truth) { return std::abs(Rational(Rational(value) - truth).get_d()); }

/// The point's distance from the triangle's plane, at most per axis.
inline double off_plane(const RayD& ray, const HitD& hit, const Corners& c) {
  const Rational3 o = exact(ray.origin), d = exact(ray.direction), p0 = exact(vec(c.p0));
  const Rational t(hit.t);
  const Rational3 from = minus({o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]}, p0);
  const Rational3 n = cross(minus(exact(vec(c.p1)), p0), minus(exact(vec(c.p2)), p0));
  const Rational distance = abs(dot(from, n)) / (abs(n[0]) + abs(n[1]) + abs(n[2]));
  return distance.get_d();
}

/// A ray from within @p reach of @p center at a point of a triangle's interior, or beyond.
inline RayD ray_at_triangle(const Mesh& mesh, Random& random, const Double3& center, double reach) {
  const Corners c = corners(mesh, random.below(static_cast<std::uint32_t>(mesh.triangles.size())));
  const double u = random.unit(), v = random.unit() * (1 - u);
  const Vec3D target = vec(c.p0) + u * (vec(c.p1) - vec(c.p0)) + v * (vec(c.p2) - vec(c.p0));
  RayD ray;
  ray.origin = vec(center) + reach * vec(random.on_sphere());
  ray.direction = target - ray.origin;
  ray.direction *= random.log_uniform(1e-3, 1e3);
  return ray;
}

inline void check_same(const HitD& a, const HitD& b) {
  REQUIRE(a.found() == b.found());
  if (!a.found()) return;
  REQUIRE(a.t == b.t);
  REQUIRE(a.u == b.u);
  REQUIRE(a.v == b.v);
  REQUIRE(a.geometry == b.geometry);
  REQUIRE(a.primitive == b.primitive);
  REQUIRE(a.error == b.error);
}

}  // namespace hiprt::checks
