// The Stanford bunny of Debian's glmark2-data, a scanned surface that is neither closed nor regular. Compared with
// Embree, with exact arithmetic, and with itself under every builder, layout and leaf size. Without the file the test
// is skipped.

#include <tests/traversal/aim.h>
#include <tests/traversal/embree_agreement.h>
#include <tests/traversal/tracers.h>
#include <tests/traversal/workers.h>
#include <tools/scene_io/mesh/mesh_import.h>

#include <tests/catch.h>

#include <cstdlib>
#include <filesystem>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr const char* kPath = "/usr/share/glmark2/models/bunny.obj";
constexpr std::uint64_t kSeed = 1994;
constexpr int kSkipped = 77;

/// The bunny, and where it is.
struct Bunny {
  Mesh mesh;
  Double3 center{};
  double radius = 0;
};

/// Ends the program when the file is not there.
const Bunny& bunny() {
  static const Bunny result = [] {
    if (!std::filesystem::exists(kPath)) {
      std::printf("skipped: no %s (Debian package glmark2-data)\n", kPath);
      std::exit(kSkipped);
    }
    auto loaded = tools::load_mesh(kPath);
    if (!loaded) FAIL(loaded.error().message);
    Bunny made;
    made.mesh.positions = std::move(loaded->positions);
    made.mesh.triangles = std::move(loaded->triangles);
    std::array<double, 3> low{}, high{};
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = high[k] = double{made.mesh.positions[0][k]};
      for (const Position& p : made.mesh.positions)
        low[k] = std::min(low[k], double{p[k]}), high[k] = std::max(high[k], double{p[k]});
      made.center[k] = 0.5 * (low[k] + high[k]);
      made.radius = std::max(made.radius, 0.5 * (high[k] - low[k]));
    }
    return made;
  }();
  return result;
}

/// From around the bunny or from its surface, at vertices, edges and points of triangles, or in any direction.
Ray random_ray(Random& random) {
  const Bunny& b = bunny();
  const auto point = [&] {
    const Position p = random.in_cube(2 * b.radius);
    return rounded({p[0] + b.center[0], p[1] + b.center[1], p[2] + b.center[2]});
  };
  Ray ray;
  ray.origin = vec3(random.below(4) == 0 ? rounded(target_point(b.mesh, random)) : point());
  ray.direction = vec3(random.below(4) == 0 ? point() : rounded(target_point(b.mesh, random))) - ray.origin;
  if (random.below(8) == 0) ray.direction[static_cast<int>(random.below(3))] = 0.0f;
  if (random.below(4) == 0) ray.tmax = random.uniform_float(0, 2);
  return ray;
}

}  // namespace

TEST_CASE("the bunny has Embree's hits", "[real]") {
  REQUIRE(bunny().mesh.triangles.size() > 60000);
  print_agreement_header();
  check_agreement("bunny", bunny().mesh, random_ray, trials(60000), kSeed);
}

TEST_CASE("the bunny with every builder, layout and leaf size, and by exact arithmetic", "[real]") {
  INFO("seed " << kSeed);
  const std::vector<Scene> scenes = all_scenes({bunny().mesh});
  Random random(kSeed);
  for (unsigned i = 0; i < trials(20000); ++i) {
    const Ray ray = random_ray(random);
    const Hit hit = default_tracer().closest(scenes[0], ray);
    INFO(describe(ray) << "\n" << describe(hit));
    REQUIRE(find_difference(scenes, ray, hit) == "");
  }
  Comparison sum;
  const auto shoot = [&](std::size_t i, Comparison& part) {
    Random own(kSeed + 1 + i);
    const Ray ray = random_ray(own);
    compare(std::span(&bunny().mesh, 1), ray, default_tracer().closest(scenes[0], ray), kBounds, part);
  };
  for (const Comparison& part : for_each_parallel<Comparison>(trials(1000), shoot)) add(sum, part);
  std::printf("bunny: %lu rays, %lu hits, point %.2f, plane %.2f, inside %.2f, t %.2f\n", sum.rays, sum.hits,
              sum.worst_point, sum.worst.plane, sum.worst.inside, sum.worst.t);
  INFO(sum.first_unexplained);
  CHECK(sum.unexplained == 0);
  CHECK(sum.hits > sum.rays / 5);
}
