// Rays from inside closed meshes at shared edges and vertices: the default policies leak none, anywhere in the
// documented range of positions and scales. The misses of the fast policies are counted and printed.

#include <hiprt_device/math/vec_functions.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/scenes.h>
#include <tests/traversal/tracers.h>
#include <tests/traversal/workers.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 31;
constexpr unsigned kBlock = 2000;

struct Leaks {
  std::uint64_t rays = 0, closest = 0, any = 0;
  std::string first;
};

/// Shoots rays with one tracer from several threads. @param stretch see aimed_ray().
Leaks count_leaks(const Scene& scene, const Closed& closed, const Tracer& tracer, unsigned rays, double stretch) {
  const std::size_t blocks = (rays + kBlock - 1) / kBlock;
  const auto shoot = [&](std::size_t block, Leaks& leaks) {
    Random random(kSeed + block);
    for (unsigned i = 0; i < kBlock; ++i) {
      const Ray ray = aimed_ray(closed, random, stretch);
      ++leaks.rays;
      const bool closest = tracer.closest(scene, ray).found(), any = tracer.any(scene, ray).found();
      if (!(closest && any) && leaks.first.empty()) leaks.first = describe(ray);
      leaks.closest += closest ? 0 : 1;
      leaks.any += any ? 0 : 1;
    }
  };
  Leaks sum;
  for (const Leaks& part : for_each_parallel<Leaks>(blocks, shoot)) {
    sum.rays += part.rays;
    sum.closest += part.closest;
    sum.any += part.any;
    if (sum.first.empty()) sum.first = part.first;
  }
  return sum;
}

struct Placement {
  double scale;
  Double3 offset;
  double stretch;  ///< Keeps (largest coordinate) / (largest direction component) below 2^90.
};

/// @return scales from 1e-20 to 1e18 around the origin, and offsets up to 1e7.
std::vector<Placement> placements() {
  std::vector<Placement> result;
  for (const double scale : {1e-20, 1e-15, 1e-8, 1.0, 1e8, 1e15})
    result.push_back({scale, {0, 0, 0}, scale < 1e-10 ? 1e9 : 1e15});
  result.push_back({1e18, {0, 0, 0}, 1e9});
  result.push_back({1, {1e3, 1e3, 1e3}, 1e6});
  result.push_back({10, {1e3, -1e3, 1e3}, 1e6});
  result.push_back({10, {148376, 1234, -223423}, 1e6});
  result.push_back({1e3, {148376, 1234, -223423}, 1e6});
  result.push_back({1e3, {1e7, 1e7, 1e7}, 1e6});
  result.push_back({1e5, {1e7, -1e7, 0}, 1e6});
  return result;
}

/// Half boxes far from the origin, or of tiny meshes, are those of the whole scene: right, but every ray would test
/// every triangle.
std::vector<NodeLayout> layouts_for(const Placement& at) {
  std::vector<NodeLayout> layouts{NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kQuantized};
  if (at.scale >= 1 && at.scale <= 10 && std::abs(at.offset[0]) <= 1e3) layouts.push_back(NodeLayout::kHalf);
  return layouts;
}

/// The exact oracle confirms for some rays that there is something to hit: rounding vertices did not open the mesh.
void require_closed_exactly(const Closed& closed) {
  Random random(kSeed);
  for (int i = 0; i < 10; ++i) {
    const Ray ray = aimed_ray(closed, random, 1.0);
    INFO(describe(ray));
    REQUIRE(closest(std::span(&closed.mesh, 1), ray).found);
  }
}

std::string row(const Placement& at) {
  char text[100];
  std::snprintf(text, sizeof text, "%g at (%g, %g, %g)", at.scale, at.offset[0], at.offset[1], at.offset[2]);
  return text;
}

}  // namespace

TEST_CASE("no ray from inside leaves a closed mesh", "[watertight]") {
  INFO("seed " << kSeed);
  std::uint64_t total = 0;
  for (const Closed& unit : closed_meshes())
    for (const Placement& at : placements()) {
      const Closed closed = checks::placed(unit, at.scale, at.offset);
      INFO(closed.name << ", " << row(at));
      REQUIRE(is_closed(closed.mesh));
      require_closed_exactly(closed);
      std::size_t k = 0;
      for (const NodeLayout layout : layouts_for(at))
        for (const Tracer& tracer : default_tracers()) {
          const Scene scene =
              make_scene({closed.mesh}, {.nodes = layout, .max_leaf_triangles = ++k % 2 == 0 ? 4u : 1u});
          const Leaks leaks = count_leaks(scene, closed, tracer, trials(20000), at.stretch);
          total += 2 * leaks.rays;
          INFO(tracer.name << ", first leak: " << leaks.first);
          CHECK(leaks.closest == 0);
          CHECK(leaks.any == 0);
        }
    }
  std::printf("watertight: %lu queries, all hit\n", total);
}

TEST_CASE("leaks of each pair of policies (printed)", "[watertight]") {
  std::printf("%-12s %-32s", "mesh", "leaks per million at");
  for (const Tracer& tracer : all_tracers()) std::printf(" %26s", tracer.name);
  std::printf("\n");
  for (const Closed& unit : closed_meshes())
    for (const Placement& at : {Placement{1, {0, 0, 0}, 10}, Placement{10, {1e3, -1e3, 1e3}, 10}}) {
      const Closed closed = checks::placed(unit, at.scale, at.offset);
      const Scene scene = make_scene({closed.mesh});
      std::printf("%-12s %-32s", closed.name.c_str(), row(at).c_str());
      for (const Tracer& tracer : all_tracers()) {
        const Leaks leaks = count_leaks(scene, closed, tracer, trials(20000), at.stretch);
        std::printf(" %26.0f", 1e6 * static_cast<double>(leaks.closest) / static_cast<double>(leaks.rays));
        if (tracer.guaranteed) CHECK(leaks.closest == 0);
      }
      std::printf("\n");
    }
}

TEST_CASE("the closed fans of the vertex tests are hit once or more, never past the first surface", "[watertight]") {
  // From the centre of a sphere every hit lies between the inner radius of the faces and 1: a hit farther away would be
  // one on the other side of a leak, which a tmin behind the surface would show.
  const Closed closed = closed_meshes().front();
  const Scene scene = make_scene({closed.mesh});
  Random random(kSeed + 1);
  for (unsigned i = 0; i < trials(50000); ++i) {
    Ray ray = aimed_ray(closed, random, 1.0);
    ray.origin = Vec3(0);
    const float length = glm::length(ray.direction);
    for (const Tracer& tracer : default_tracers()) {
      const Hit hit = tracer.closest(scene, ray);
      INFO(describe(ray) << "\n" << describe(hit));
      REQUIRE((hit.t * length > 0.99f && hit.t * length < 1.00001f));
    }
  }
}
