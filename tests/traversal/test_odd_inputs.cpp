// Edge cases of builder input: nothing, one triangle, copies, triangles that must be dropped.

#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/scenes.h>
#include <tests/traversal/tracers.h>

#include <hiprt_build/format/validate.h>

#include <tests/catch.h>

#include <chrono>
#include <set>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Validates every variant's file and compares its stack bound with the traversal's stack.
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

/// A ray from within @p size at an inner point of a triangle; its direction is about as long as 1, so that it has
/// reciprocals.
Ray inner_ray(const Mesh& mesh, double size, Random& random) {
  const Corners c = corners(mesh, random.below(static_cast<std::uint32_t>(mesh.triangles.size())));
  const double u = random.unit(), v = random.unit() * (1 - u);
  const Position from = random.in_cube(size);
  Double3 to_target{};
  for (std::size_t k = 0; k < 3; ++k)
    to_target[k] = c.p0[k] + u * (double{c.p1[k]} - c.p0[k]) + v * (double{c.p2[k]} - c.p0[k]) - from[k];
  const double longest = std::max({std::abs(to_target[0]), std::abs(to_target[1]), std::abs(to_target[2])});
  const int exponent = longest > 0 ? -std::ilogb(longest) : 0;
  const Vec3 direction(static_cast<float>(std::ldexp(to_target[0], exponent)),
                       static_cast<float>(std::ldexp(to_target[1], exponent)),
                       static_cast<float>(std::ldexp(to_target[2], exponent)));
  return {vec3(from), 0, direction, std::numeric_limits<float>::max(), 0xffffffffu};
}

/// All scenes and tracers have the hits of brute force for inner_ray(). @return of those, how many hit.
std::uint64_t compare_with_brute_force(const std::vector<Mesh>& meshes, double size, unsigned rays, Random& random) {
  const std::vector<Scene> scenes = all_scenes(meshes);
  require_valid(scenes);
  Comparison comparison;
  for (unsigned i = 0; i < rays; ++i) {
    const Ray ray = inner_ray(meshes[0], size, random);
    const Hit hit = default_tracer().closest(scenes[0], ray);
    INFO(describe(ray));
    REQUIRE(find_difference(scenes, ray, hit) == "");
    compare(meshes, ray, hit, kBounds, comparison);
    INFO(comparison.first_unexplained);
    REQUIRE(comparison.unexplained == 0);
  }
  return comparison.hits;
}

/// The triangles that a builder keeps of a finite mesh.
Mesh without_degenerate(Mesh mesh) {
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    const Position &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    return a == b || b == c || c == a;
  });
  return mesh;
}

/// A mesh that every builder must build to a valid file with one leaf per triangle and part, in which rays have the
/// hits of brute force.
void require_buildable(const Mesh& mesh, const std::vector<Ray>& rays = {}) {
  std::vector<Hit> hits;
  for (const auto& [word, builder] : tools::kBuilders) {
    CAPTURE(word);
    const Scene scene = make_scene({mesh}, {.builder = builder});
    const auto summary = validate(scene.view.bytes);
    INFO((summary ? "" : to_string(summary.error())));
    REQUIRE(summary.has_value());
    REQUIRE(scene.view.header->stack_bound <= stack_capacity());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) REQUIRE(scene.view.primitive_map[i] != kInvalidId);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Hit hit = default_tracer().closest(scene, rays[i]);
      INFO(describe(rays[i]) << "\n" << describe(hit));
      if (hits.size() == i) hits.push_back(hit);
      REQUIRE(same_hit(hit, hits[i]));
    }
  }
  Comparison comparison;
  for (std::size_t i = 0; i < rays.size(); ++i) compare(std::span(&mesh, 1), rays[i], hits[i], kBounds, comparison);
  INFO(comparison.first_unexplained);
  REQUIRE(comparison.unexplained == 0);
  REQUIRE(comparison.hits >= rays.size() / 2);
}

}  // namespace

TEST_CASE("coordinates from 2^-100 to 2^60: valid trees, and the hits of brute force", "[odd]") {
  const std::uint64_t seed = GENERATE(11u, 12u);
  INFO("seed " << seed);
  Random random(seed);
  for (const int exponent : {-99, -60, 0, 30, 59}) {
    CAPTURE(exponent);
    const double scale = std::ldexp(0.5, exponent);
    const Mesh mesh = placed(soup(60, 0.5, random.bits()), scale);
    CHECK(compare_with_brute_force({mesh}, 0.5 * scale, 100, random) > 50);
  }
}

TEST_CASE("smaller and larger coordinates, where rays may miss (ray.h): valid trees with all triangles", "[odd]") {
  const std::uint64_t seed = 13;
  INFO("seed " << seed);
  Random random(seed);
  for (const int exponent : {-148, -142, -126, -110, 63, 64, 90, 126, 127}) {
    CAPTURE(exponent);
    // Of denormal corners two can be one.
    const Mesh mesh = without_degenerate(placed(soup(200, 0.5, random.bits()), std::ldexp(0.6, exponent)));
    require_buildable(mesh);
    for (const Scene& scene : all_scenes({mesh}))
      for (unsigned i = 0; i < 20; ++i) {
        const Ray ray{vec3(random.in_cube(std::ldexp(0.5, exponent))), 0, vec3(random.in_cube(1)), kInfinity,
                      0xffffffffu};
        const Hit hit = default_tracer().closest(scene, ray);
        CHECK((!hit.found() || hit.primitive < mesh.triangles.size()));
      }
  }
}

TEST_CASE("triangles of all sizes in one mesh: valid trees, and the hits of brute force", "[odd]") {
  const std::uint64_t seed = GENERATE(21u, 22u);
  INFO("seed " << seed);
  Random random(seed);
  Mesh mesh;
  for (int exponent = -120; exponent <= 60; exponent += 3)
    append(mesh, placed(soup(2, 1.0, random.bits()), std::ldexp(1.0, exponent)));
  for (const int size : {-90, -30, 0, 30}) {
    CAPTURE(size);
    CHECK(compare_with_brute_force({mesh}, std::ldexp(1.0, size), 60, random) > 20);
  }
}

TEST_CASE("the largest floats: areas are infinite or NaN, trees are valid and have all triangles", "[odd]") {
  constexpr float kMost = std::numeric_limits<float>::max();
  const std::uint64_t seed = GENERATE(31u, 32u, 33u);
  INFO("seed " << seed);
  Random random(seed);
  const auto coordinate = [&] {
    const float values[] = {kMost, -kMost, 0.5f * kMost, 0.0f, 1.0f, -1.0f, std::numeric_limits<float>::denorm_min()};
    return values[random.below(std::size(values))];
  };
  const auto corner = [&] { return Position{coordinate(), coordinate(), coordinate()}; };
  Mesh mesh, flat;
  for (unsigned i = 0; i < 300; ++i) {
    append(mesh, corner(), corner(), corner());
    append(flat, Position{coordinate(), 0, 0}, Position{coordinate(), coordinate(), 0}, Position{0, coordinate(), 0});
  }
  for (const Mesh& each : {without_degenerate(mesh), without_degenerate(flat)}) {
    REQUIRE(each.triangles.size() > 100);
    require_buildable(each);
    require_valid(all_scenes({each}));
  }
}

TEST_CASE("triangles on one line, and in one row", "[odd]") {
  const std::uint64_t seed = 41;
  INFO("seed " << seed);
  Random random(seed);
  for (const Position& along : {Position{1, 0, 0}, Position{0, 1, 1}, Position{1, 2, 3}}) {
    const auto at = [&](float x) { return Position{x * along[0], x * along[1], x * along[2]}; };
    Mesh line, row;
    for (unsigned i = 0; i < 300; ++i) {
      append(line, at(random.uniform_float(-9, 9)), at(random.uniform_float(-9, 9)), at(random.uniform_float(-9, 9)));
      const Position middle = at(static_cast<float>(i) / 8), size = random.in_cube(0.5);
      append(row, {middle[0] - size[0], middle[1] - size[1], middle[2] - size[2]},
             {middle[0] + size[0], middle[1] + size[1], middle[2] + size[2]},
             {middle[0] + size[1], middle[1] + size[2], middle[2] + size[0]});
    }
    const std::vector<Scene> scenes = all_scenes({line});
    require_valid(scenes);
    for (unsigned i = 0; i < 100; ++i) {
      const Position from = random.in_cube(1), to = at(random.uniform_float(-9, 9));
      const Ray ray{vec3(from), 0, vec3(to) - vec3(from), kInfinity, 0xffffffffu};
      REQUIRE(find_difference(scenes, ray, default_tracer().closest(scenes[0], ray)) == "");
    }
    CHECK(compare_with_brute_force({row}, 20, 60, random) > 40);
  }
}

TEST_CASE("every builder: sizes at the borders of tasks and chunks, and the hits of brute force", "[odd]") {
  const std::uint64_t seed = 52;
  INFO("seed " << seed);
  Random random(seed);
  for (const unsigned count : {1023u, 1025u, 2047u, 2049u, 4095u, 4097u, 8191u, 8192u, 8193u, 65535u, 65536u, 65537u}) {
    CAPTURE(count);
    const Mesh mesh = soup(count, 0.01, count);
    std::vector<Ray> rays;
    for (unsigned i = 0; i < 10; ++i) rays.push_back(inner_ray(mesh, 1.5, random));
    require_buildable(mesh, rays);
  }
}

TEST_CASE("no geometry and empty geometries: every ray misses", "[odd]") {
  for (const std::vector<Mesh>& meshes : {std::vector<Mesh>{}, std::vector<Mesh>{Mesh{}},
                                          std::vector<Mesh>{Mesh{}, Mesh{}}, std::vector<Mesh>{Mesh{{}, {}, 1}}}) {
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

TEST_CASE("2^k +- 1 triangles: valid trees, and the hits of brute force", "[odd]") {
  const std::uint64_t seed = 51;
  INFO("seed " << seed);
  Random random(seed);
  for (const unsigned power : {16u, 32u, 64u, 128u, 256u, 1024u})
    for (const unsigned count : {power - 1, power, power + 1}) {
      CAPTURE(count);
      CHECK(compare_with_brute_force({soup(count, 0.1, random.bits())}, 1.5, 30, random) > 20);
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
