// Inputs at the edges of what a builder takes: nothing, one triangle, copies, triangles that must be dropped.

#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/scenes.h>
#include <tests/traversal/tracers.h>

#include <hiprt_device/format/validate.h>

#include <catch2/catch.hpp>

#include <chrono>
#include <set>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Validates every variant's file and holds its stack bound against what the traversal has.
void require_valid(const std::vector<Scene>& scenes) {
  for (const Scene& scene : scenes) {
    CAPTURE(scene.name);
    const auto summary = validate(scene.view.bytes);
    INFO((summary ? "" : to_string(summary.error())));
    REQUIRE(summary.has_value());
    REQUIRE(scene.view.header->stack_bound <= stack_capacity());
    REQUIRE(summary->stack_need <= scene.view.header->stack_bound);
  }
}

/// Shoots a ray through the middle of every triangle, from near by. @return the primitives that were hit.
std::set<std::uint32_t> hit_primitives(const Scene& scene, const Mesh& mesh) {
  std::set<std::uint32_t> result;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Corners c = corners(mesh, i);
    const Vec3 middle = (vec3(c.p0) + vec3(c.p1) + vec3(c.p2)) / 3.0f;
    for (const Vec3& d : {Vec3(1, 0.1f, 0.2f), Vec3(0.1f, 1, 0.2f), Vec3(0.2f, 0.1f, 1)}) {
      const Hit hit = default_tracer().closest(scene, Ray{middle - d, 0, d, 2, 0xffffffffu});
      if (hit.found()) result.insert(hit.primitive);
    }
  }
  return result;
}

}  // namespace

TEST_CASE("no geometry and empty geometries: every ray misses", "[odd]") {
  for (const std::vector<Mesh>& meshes :
       {std::vector<Mesh>{}, std::vector<Mesh>{Mesh{}}, std::vector<Mesh>{Mesh{}, Mesh{}},
        std::vector<Mesh>{Mesh{{{1, 2, 3}}, {}, 1}}}) {
    const std::vector<Scene> scenes = all_scenes(meshes);
    require_valid(scenes);
    for (const Scene& scene : scenes)
      for (const Tracer& tracer : all_tracers()) {
        const Ray ray{Vec3(0), 0, Vec3(1, 2, 3), kInfinity, 0xffffffffu};
        CHECK_FALSE(tracer.closest(scene, ray).found());
        CHECK_FALSE(tracer.any(scene, ray).found());
        CHECK_FALSE(tracer.closest(scene, ray).failed());
      }
  }
}

TEST_CASE("one to twenty triangles, apart and connected", "[odd]") {
  for (unsigned count = 1; count <= 20; ++count) {
    CAPTURE(count);
    Mesh apart, strip;
    for (unsigned i = 0; i < count; ++i) {
      const auto x = static_cast<float>(i);
      append(apart, Position{3 * x, 0, 0}, Position{3 * x + 1, 0, 0}, Position{3 * x, 1, 0});
    }
    for (unsigned i = 0; i < count + 2; ++i) {
      const unsigned column = i / 2;
      strip.positions.push_back({static_cast<float>(column), static_cast<float>(i % 2), 0});
    }
    for (unsigned i = 0; i < count; ++i) strip.triangles.push_back({i, i + 1, i + 2});
    for (const Mesh& mesh : {apart, strip}) {
      const std::vector<Scene> scenes = all_scenes({mesh});
      require_valid(scenes);
      for (unsigned i = 0; i < count; ++i) {
        const Corners c = corners(mesh, i);
        const Vec3 middle = (vec3(c.p0) + vec3(c.p1) + vec3(c.p2)) / 3.0f;
        const Ray ray{middle + Vec3(0, 0, 2), 0, Vec3(0, 0, -1), kInfinity, 0xffffffffu};
        const Hit hit = default_tracer().closest(scenes[0], ray);
        REQUIRE(hit.primitive == i);
        REQUIRE(hit.t == Approx(2).epsilon(1e-6));
        REQUIRE(find_difference(scenes, ray, hit) == "");
      }
    }
  }
}

TEST_CASE("2^k +- 1 triangles", "[odd]") {
  for (const unsigned count : {31u, 32u, 33u, 63u, 64u, 65u, 255u, 256u, 257u, 1023u, 1024u, 1025u}) {
    CAPTURE(count);
    const std::vector<Mesh> meshes{soup(count, 0.1, count)};
    const std::vector<Scene> scenes = all_scenes(meshes);
    require_valid(scenes);
  }
}

TEST_CASE("all centroids at one point", "[odd]") {
  const std::vector<Mesh> meshes{concentric(300, 4)};
  const std::vector<Scene> scenes = all_scenes(meshes);
  require_valid(scenes);
  Random random(5);
  Comparison comparison;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 o = vec3(random.in_cube(2)), to = vec3(random.in_cube(0.3));
    const Ray ray{o, 0, to - o, kInfinity, 0xffffffffu};
    const Hit hit = default_tracer().closest(scenes[0], ray);
    REQUIRE(find_difference(scenes, ray, hit) == "");
    compare(meshes, ray, hit, kBounds, comparison);
    INFO(comparison.first_unexplained);
    REQUIRE(comparison.unexplained == 0);
  }
  CHECK(comparison.hits > 500);
}

TEST_CASE("a hundred thousand identical triangles build and trace in bounded time", "[odd]") {
  const std::vector<Mesh> meshes{identical(100000)};
  for (const auto& [word, builder] : tools::kBuilders) {
    CAPTURE(build::name(builder));
    const auto start = std::chrono::steady_clock::now();
    const Scene scene = make_scene(meshes, {.builder = builder});
    const Ray ray{Vec3(0, 0, 1), 0, Vec3(0, 0, -1), kInfinity, 0xffffffffu};
    const Hit hit = default_tracer().closest(scene, ray);
    CHECK(hit.primitive == 0);
    CHECK(hit.t == Approx(1).epsilon(1e-6));
    CHECK(default_tracer().any(scene, ray).found());
    CHECK(scene.view.header->stack_bound <= stack_capacity());
    CHECK(validate(scene.view.bytes).has_value());
    // Generous: the point is that nothing is quadratic.
    CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(60));
  }
}

TEST_CASE("triangles that are not finite or have a repeated corner are dropped, counted, and never hit", "[odd]") {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  Mesh mesh;
  append(mesh, Position{0, 0, 0}, Position{1, 0, 0}, Position{0, 1, 0});
  append(mesh, Position{0, 0, 1}, Position{1, 0, kNan}, Position{0, 1, 1});
  append(mesh, Position{0, 0, 1}, Position{1, 0, 1}, Position{0, kInfinity, 1});
  append(mesh, Position{0, 0, 1}, Position{0, 0, 1}, Position{0, 1, 1});
  append(mesh, Position{0, 0, -1}, Position{1, 0, -1}, Position{0, 1, -1});
  append(mesh, Position{0.0f, 0, 1}, Position{1, 0, 1}, Position{-0.0f, -0.0f, 1});
  for (const Scene& scene : all_scenes({mesh})) {
    CAPTURE(scene.name);
    CHECK(scene.bvh.statistics.triangles == 6);
    CHECK(scene.bvh.statistics.dropped_not_finite == 2);
    CHECK(scene.bvh.statistics.dropped_degenerate == 2);
    CHECK(scene.view.geometries[0].dropped_count == 4);
    for (const std::uint32_t i : {1u, 2u, 3u, 5u}) CHECK(scene.view.primitive_map[i] == kInvalidId);
    CHECK(hit_primitives(scene, mesh) == std::set<std::uint32_t>{0, 4});
  }
}

TEST_CASE("only dropped triangles: an empty scene that keeps its numbering", "[odd]") {
  Mesh mesh;
  append(mesh, Position{0, 0, 1}, Position{0, 0, 1}, Position{0, 1, 1});
  const std::vector<Scene> scenes = all_scenes({mesh});
  require_valid(scenes);
  for (const Scene& scene : scenes) {
    CHECK(scene.view.header->primitive_count == 1);
    CHECK(hit_primitives(scene, mesh).empty());
  }
}

TEST_CASE("torture sets build, validate and trace with every builder", "[odd]") {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    CAPTURE(seed);
    const std::vector<Mesh> meshes{torture(1500, seed), Mesh{}, torture(200, seed + 10)};
    const std::vector<Scene> scenes = all_scenes(meshes);
    require_valid(scenes);
    for (const Scene& scene : scenes)
      for (std::size_t g = 0; g < 3; g += 2)
        for (std::size_t i = 0; i < meshes[g].triangles.size(); ++i) {
          const Corners c = corners(meshes[g], i);
          const bool dropped = !is_finite(c) || c.p0 == c.p1 || c.p1 == c.p2 || c.p2 == c.p0;
          const std::size_t number = scene.view.geometries[g].first_primitive + i;
          REQUIRE((scene.view.primitive_map[number] == kInvalidId) == dropped);
        }
  }
}
