#pragma once
/// Closed meshes: rays from inside, mostly aimed at vertices and edges, do not leak, and lines cross the surface an
/// even number of times.

#include <hiprt_device/intersect/exact_triangle_test.h>
#include <hiprt_device/query/t_error.h>
#include <tests/flags/check.h>
#include <tests/flags/lattice.h>

#include <string>

namespace hiprt::flags {

/// @param scene the closed mesh alone, or at the end of one path of still or moving instances.
template <class P>
unsigned closed_meshes(const std::string& name, const SceneView& scene, const Mesh& mesh, unsigned rays = 20000) {
  using Real = typename P::Real;
  Check check(name + ": no leak", kSeed + 1);
  Random random(kSeed + 1);
  const auto path = only_path<P::kLevels>(scene);
  const bool moves = (scene.features & feature_bit(Feature::kMotion)) != 0;
  for (unsigned i = 0; i < rays; ++i) {
    const Vec3 from = lattice_point(random, 128);
    const Vec3 to = target(mesh, random);
    const float time = moves ? any_time(random) : 0.0f;
    Ray aimed = between(to_scene(scene, path, time, from), to_scene(scene, path, time, to));
    aimed.time = time;
    const auto ray = convert<Real>(aimed);
    check.on_ray(ray);
    const auto hit = closest<P>(scene, ray);
    check.on_hit(hit);
    if (check.expect(hit.found(), hit.failed() ? "failed" : "leaks")) check.put_out(t_error(scene, ray, hit));
  }
  return check.finish(rays);
}

/// Rays from outside cross the surface an even number of times.
inline unsigned even_crossings(const SceneView& scene, const Mesh& mesh) {
  struct P : Policies {
    using Triangle = Reference;
  };
  Check check("Reference: even crossings", kSeed + 2);
  Random random(kSeed + 2);
  P::Stack::Memory memory;
  for (unsigned i = 0; i < 20000; ++i) {
    Vec3 from = lattice_point(random, 8192);
    from.x += 8.0f;
    const Ray ray = between(from, target(mesh, random));
    check.on_ray(ray);
    AllHits<P> query(scene, ray, memory);
    std::uint32_t count = 0;
    while (query.next_hit().found()) ++count;
    check.expect(count % 2 == 0, "crosses %u times", count);
    check.put_out(count);
    const Hit first = closest<P>(scene, ray);
    check.on_hit(first);
    check.expect(first.found() == (count != 0), "%u hits, but closest_hit() does not agree", count);
  }
  return check.finish(10000);
}

}  // namespace hiprt::flags
