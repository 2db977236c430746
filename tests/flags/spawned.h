#pragma once
/// Hits lie within their error bound of the triangle. A ray that starts at spawn_origin() starts near the hit and does
/// not hit the triangle again.

#include <hiprt_device/intersect/exact_triangle_test.h>
#include <hiprt_device/query/spawn.h>
#include <tests/flags/boxes.h>

#include <array>
#include <cmath>
#include <string>
#include <type_traits>

namespace hiprt::flags {

/// Where a ray is at t, before any rounding that matters.
template <class Real> std::array<long double, 3> exact_point(const BasicRay<Real>& ray, Real t) {
  std::array<long double, 3> at{};
  for (int k = 0; k < 3; ++k)
    at[static_cast<unsigned>(k)] = static_cast<long double>(ray.origin[k]) +
                                   static_cast<long double>(t) * static_cast<long double>(ray.direction[k]);
  return at;
}

inline double distance(const std::array<long double, 3>& at, const Vec3D& from) {
  long double squared = 0;
  for (int k = 0; k < 3; ++k) {
    const long double step = at[static_cast<unsigned>(k)] - static_cast<long double>(from[k]);
    squared += step * step;
  }
  return static_cast<double>(std::sqrt(squared));
}

/// The distance of a point from the plane of three corners, in units of the extent of a box of half width 1 along the
/// normal. No area: infinitely far.
inline double distance_from_plane(const std::array<long double, 3>& at, const Vec3D (&corner)[3]) {
  const auto edge = [&](unsigned to, int k) {
    return static_cast<long double>(corner[to][k]) - static_cast<long double>(corner[0][k]);
  };
  long double along = 0, sum = 0;
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3, last = (k + 2) % 3;
    const long double normal = edge(1, next) * edge(2, last) - edge(1, last) * edge(2, next);
    along += normal * (at[static_cast<unsigned>(k)] - static_cast<long double>(corner[0][k]));
    sum += std::fabs(normal);
  }
  return static_cast<double>(std::fabs(along) / sum);
}

/// A direction away from a triangle: any, back or onward, along the normal, along an edge, or nearly along one.
template <class Real>
BasicVec3<Real> leaving_direction(const BasicRay<Real>& ray, const BasicHit<Real>& hit, const Vec3& edge,
                                  Random& random) {
  const std::uint32_t kind = random.below(6);
  const Vec3 anywhere = lattice_point(random, 4096);
  const float sign = random.coin() ? 1.0f : -1.0f, length = power(random, 10);
  const auto little = static_cast<float>(integer(random, 8)) * 0x1p-10f;
  BasicVec3<Real> direction(anywhere);
  if (kind == 0) direction = -ray.direction;
  if (kind == 1) direction = ray.direction;
  if (kind == 2) direction = hit.normal * Real(sign);
  if (kind == 3) direction = BasicVec3<Real>(edge * sign);
  if (kind == 4) direction = BasicVec3<Real>(edge * sign) + BasicVec3<Real>(anywhere * little);
  if (!(max_component(direction) > Real(0))) direction.x = Real(1);
  return direction * Real(length);
}

/// The ray in the space of the object at the end of an instance path.
template <unsigned kLevels, class Real>
BasicRay<Real> seen_from(const SceneView& scene, const InstancePath<kLevels>& path, BasicRay<Real> ray) {
  follow(scene, path, ray.time, [&](const InstanceRecord& record, const ObjectRecord&, const MotionRecord*) {
    ray = ray_to_object(record, ray);
  });
  return ray;
}

/// A ray from inside or from outside, at the mesh or near its middle, at any time if the scene moves.
template <unsigned kLevels>
Ray ray_at_mesh(const SceneView& scene, const InstancePath<kLevels>& path, const Mesh& mesh, Random& random) {
  const Vec3 from = lattice_point(random, random.coin() ? 128 : 8192);
  const Vec3 to = random.below(3) == 0 ? target(mesh, random) : lattice_point(random, 1024);
  const bool moves = (scene.features & feature_bit(Feature::kMotion)) != 0;
  const float time = moves ? any_time(random) : 0.0f;
  Ray ray = between(to_scene(scene, path, time, from), to_scene(scene, path, time, to));
  ray.time = time;
  return ray;
}

/// The spawned ray @p next starts near the hit of @p ray and does not hit the triangle again.
/// @param path the instance path to the mesh.
template <class P>
void expect_leaves(Check& check, const SceneView& scene, const InstancePath<P::kLevels>& path, const Mesh& mesh,
                   const BasicRay<typename P::Real>& ray, const BasicHit<typename P::Real>& hit,
                   const BasicRay<typename P::Real>& next) {
  using Test = typename P::Triangle;
  // Hit errors: sqrt(3) along a diagonal, and 1 for the rounding of the sum (docs/GUARANTEES.md).
  constexpr double kMostMoved = 2.74;
  const double moved = distance(exact_point(ray, hit.t), Vec3D(next.origin)) / double{hit.error};
  check.expect(moved <= kMostMoved, "off triangle %u: starts %.3f errors from the hit", hit.primitive, moved);
  // The test of the triangle alone sees also a hit that a nearer triangle hides.
  const auto local = seen_from(scene, path, next);
  const auto other = closest<P>(scene, next);
  const auto again =
      try_triangle<Test>(mesh, hit.primitive, local, typename Test::template PreparedRay<ArrayLanes>(local));
  check.put_out(other);
  check.expect(!again.found() && other.primitive != hit.primitive,
               "triangle %u is met again, at t %a, by the ray spawned on it: from (%a %a %a) along (%a %a %a)",
               hit.primitive, double{again.found() ? again.t : other.t}, double{next.origin.x}, double{next.origin.y},
               double{next.origin.z}, double{next.direction.x}, double{next.direction.y}, double{next.direction.z});
}

/// @param scene as for closed_meshes().
template <class P>
unsigned spawned_rays(const std::string& name, const SceneView& scene, const Mesh& mesh, unsigned rays = 6000) {
  using Real = typename P::Real;
  Check check(name + ": spawned rays", kSeed + 7);
  // The inputs do not depend on the hits.
  Random random(kSeed + 7), of_directions(kSeed + 8);
  const auto path = only_path<P::kLevels>(scene);
  for (unsigned i = 0; i < rays; ++i) {
    const auto ray = convert<Real>(ray_at_mesh(scene, path, mesh, random));
    check.on_ray(ray);
    const auto hit = closest<P>(scene, ray);
    check.on_hit(hit);
    if (!hit.found()) continue;
    Vec3D corner[3];
    for (unsigned c = 0; c < 3; ++c)
      corner[c] = to_scene_in_double(scene, path, ray.time, vec3(mesh.positions[mesh.triangles[hit.primitive][c]]));
    // Transforms of double rays err less than the judge's.
    if constexpr (P::kLevels == 0 || std::is_same_v<Real, float>) {
      const double off = distance_from_plane(exact_point(ray, hit.t), corner);
      check.expect(off <= double{hit.error}, "the hit is %a from the plane of triangle %u, more than its error %a", off,
                   hit.primitive, double{hit.error});
    }
    BasicRay<Real> next;
    next.time = ray.time;
    next.direction = leaving_direction<Real>(ray, hit, Vec3(corner[1] - corner[0]), of_directions);
    next.origin = spawn_origin<Real>(ray, hit, next.direction);
    check.put_out(next);
    expect_leaves<P>(check, scene, path, mesh, ray, hit, next);
  }
  return check.finish(rays / 3);
}

}  // namespace hiprt::flags
