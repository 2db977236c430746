#include <tests/oracle/embree_scene.h>
#include <tests/traversal/embree_agreement.h>
#include <tests/traversal/tracers.h>

#include <tests/catch.h>

namespace hiprt::checks {
namespace {

/// Counts of one mesh.
struct Agreement {
  std::uint64_t rays = 0, hits = 0, other_primitive = 0, only_ours = 0, only_theirs = 0, any_differs = 0;
  std::uint64_t inconsistent = 0;  ///< Our any hit says other than our closest hit.
  double worst_t = 0;              ///< Relative difference of t, of hits on the same primitive.
  double worst_point = 0;          ///< Distance of our point from that primitive, in eps * D.
  Comparison decided{};
};

void compare_one(const Mesh& mesh, const Scene& scene, const EmbreeScene& embree, const Ray& ray,
                 Agreement& agreement) {
  const Hit ours = default_tracer().closest(scene, ray), theirs = embree.closest(ray);
  const bool any = default_tracer().any(scene, ray).found(), any_differs = any != embree.any(ray);
  ++agreement.rays;
  agreement.hits += ours.found() ? 1 : 0;
  agreement.any_differs += any_differs ? 1 : 0;
  agreement.inconsistent += any != ours.found() ? 1 : 0;
  if (ours.primitive == theirs.primitive && !any_differs) {
    if (!ours.found()) return;
    agreement.worst_t = std::max(agreement.worst_t, std::abs(double{ours.t} - theirs.t) / std::max(1e-6f, ours.t));
    agreement.worst_point = std::max(agreement.worst_point, point_distance(ray, corners(mesh, ours.primitive), ours.t));
    return;
  }
  agreement.other_primitive += ours.found() && theirs.found() ? 1 : 0;
  agreement.only_ours += theirs.found() || !ours.found() ? 0 : 1;
  agreement.only_theirs += ours.found() || !theirs.found() ? 0 : 1;
  compare(std::span(&mesh, 1), ray, ours, kBounds, agreement.decided);
}

}  // namespace

void print_agreement_header() {
  std::printf("%-14s %8s %8s %8s %10s %12s %8s %10s %8s\n", "mesh", "rays", "hits", "other", "only ours", "only Embree",
              "any", "worst t", "point");
}

void check_agreement(const std::string& name, const Mesh& mesh, const std::function<Ray(Random&)>& random_ray,
                     unsigned rays, std::uint64_t seed) {
  INFO(name << ", seed " << seed);
  const Scene scene = make_scene({mesh});
  EmbreeScene embree;
  embree.add(mesh);
  embree.commit();
  Random random(seed);
  Agreement a;
  for (unsigned i = 0; i < rays; ++i) compare_one(mesh, scene, embree, random_ray(random), a);
  std::printf("%-14s %8lu %8lu %8lu %10lu %12lu %8lu %10.2g %8.2f\n", name.c_str(), a.rays, a.hits, a.other_primitive,
              a.only_ours, a.only_theirs, a.any_differs, a.worst_t, a.worst_point);
  INFO(a.decided.first_unexplained);
  CHECK(a.decided.unexplained == 0);
  CHECK(a.inconsistent == 0);
  CHECK(a.worst_point <= kBounds.plane);
  CHECK(a.hits > a.rays / 50);
}

}  // namespace hiprt::checks
