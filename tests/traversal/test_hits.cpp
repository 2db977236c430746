// Closest and any hits of every builder, layout and lanes policy: equal bit for bit, and right by the exact oracle.

#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/scenes.h>
#include <tests/traversal/tracers.h>
#include <tests/traversal/workers.h>

#include <hiprt_device/query/spawn.h>
#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 7;

struct Case {
  std::string name;
  std::vector<Mesh> meshes;
  double size;  ///< Half the extent of the region that rays start in.
  Double3 center{0, 0, 0};
};

std::vector<Case> cases() {
  std::vector<Case> result;
  for (const Closed& closed : closed_meshes()) {
    result.push_back({closed.name, {closed.mesh}, 1.5});
    result.push_back({closed.name + " at (148376, 1234, -223423)",
                      {oracle::placed(closed.mesh, 100, {148376, 1234, -223423})},
                      150,
                      {148376, 1234, -223423}});
  }
  result.push_back({"icosphere 1e-15", {oracle::placed(icosphere(3), 1e-15)}, 1.5e-15});
  result.push_back({"star 1e15", {oracle::placed(star(3, 2), 1e15)}, 1.5e15});
  result.push_back({"soup small", {soup(2000, 0.1, 3)}, 1.5});
  result.push_back({"soup large", {soup(300, 2.0, 4)}, 2.0});
  result.push_back({"needles 1e6", {needles(600, 1e6, 5)}, 1.5});
  result.push_back({"needles 1e7", {needles(600, 1e7, 6)}, 1.5});
  result.push_back({"slivers 1e-6", {slivers(600, 1e-6, 7)}, 1.5});
  result.push_back({"three geometries", {icosphere(2), soup(500, 0.3, 8), grid_plane(9, 2, 0.25f)}, 1.5});
  result.push_back({"twice the same", {star(2, 9), star(2, 9)}, 1.5});
  result.push_back({"torture", {torture(600, 10), torture(300, 11)}, 1.5});
  return result;
}

Position surface_point(const std::vector<Mesh>& meshes, Random& random) {
  const Mesh& mesh = meshes[random.below(static_cast<std::uint32_t>(meshes.size()))];
  return rounded(target_point(mesh, random));
}

/// Rays at surface points (edges and vertices among them), along axes, from surface points, with and without ranges.
Ray random_ray(const Case& test, Random& random) {
  Ray ray;
  const auto near = [&] {
    const Position p = random.in_cube(test.size);
    return rounded({p[0] + test.center[0], p[1] + test.center[1], p[2] + test.center[2]});
  };
  ray.origin = vec3(random.below(8) == 0 ? surface_point(test.meshes, random) : near());
  const Position to = random.below(4) == 0 ? near() : surface_point(test.meshes, random);
  const float factor = static_cast<float>(random.coin() ? 1.0 : random.log_uniform(1e-6, 1e6));
  for (int k = 0; k < 3; ++k) ray.direction[k] = (to[static_cast<std::size_t>(k)] - ray.origin[k]) * factor;
  if (random.below(8) == 0) {
    const int axis = static_cast<int>(random.below(3));
    for (int k = 0; k < 3; ++k)
      if (k != axis) ray.direction[k] = random.coin() ? 0.0f : -0.0f;
  }
  if (random.below(4) == 0) ray.tmin = random.uniform_float(0, 1.2) / factor;
  if (random.below(4) == 0) ray.tmax = random.uniform_float(0, 2) / factor;
  return ray;
}

void print_header() {
  std::printf("%-42s %8s %8s %6s %6s %6s %7s %7s %7s %7s %7s\n", "errors in eps * D (t: ulps of D)", "rays", "hits",
              "other", "float", "exact", "point", "plane", "inside", "edge", "t");
}

void print(const std::string& name, const Comparison& c) {
  std::printf("%-42s %8lu %8lu %6lu %6lu %6lu %7.2f %7.2f %7.2f %7.2f %7.2f\n", name.c_str(), c.rays, c.hits,
              c.other_primitive, c.only_float, c.only_exact, c.worst_point, c.worst.plane, c.worst.inside, c.worst_edge,
              c.worst.t);
}

/// A thread's findings.
struct Findings {
  Comparison comparison{};
  std::string different;  ///< The first scene or tracer with another hit, and the ray.
};

}  // namespace

TEST_CASE("hits do not depend on builder, layout, leaf size, pairing or lanes, and are exact up to rounding",
          "[hits]") {
  INFO("seed " << kSeed);
  print_header();
  for (const Case& test : cases()) {
    CAPTURE(test.name);
    const std::vector<Scene> scenes = all_scenes(test.meshes);
    const auto shoot = [&](std::size_t i, Findings& findings) {
      Random random(kSeed * 1000003 + i);
      const Ray ray = random_ray(test, random);
      const Hit hit = default_tracer().closest(scenes[0], ray);
      if (findings.different.empty())
        if (const std::string other = find_difference(scenes, ray, hit); !other.empty())
          findings.different = describe(ray) + "\n" + describe(hit) + "\n" + other;
      compare(test.meshes, ray, hit, kBounds, findings.comparison);
    };
    Comparison sum;
    for (const Findings& part : for_each_parallel<Findings>(trials(6000), shoot)) {
      CHECK(part.different == "");
      add(sum, part.comparison);
    }
    print(test.name, sum);
    INFO(sum.first_unexplained);
    CHECK(sum.unexplained == 0);
    CHECK(sum.hits > sum.rays / 20);
  }
}

TEST_CASE("any hit finds something exactly where closest hit does, within the range", "[hits]") {
  INFO("seed " << kSeed + 1);
  for (const Case& test : cases()) {
    CAPTURE(test.name);
    const Scene scene = make_scene(test.meshes);
    Random random(kSeed + 1);
    for (unsigned i = 0; i < trials(6000); ++i) {
      const Ray ray = random_ray(test, random);
      for (const Tracer& tracer : default_tracers()) {
        const Hit closest = tracer.closest(scene, ray), any = tracer.any(scene, ray);
        INFO(tracer.name << "\n" << describe(ray) << "\n" << describe(closest) << "\n" << describe(any));
        REQUIRE(any.found() == closest.found());
        if (any.found()) REQUIRE((any.t >= closest.t && any.t >= effective_tmin(ray) && any.t <= ray.tmax));
      }
    }
  }
}

TEST_CASE("a hit has the same bits on every machine", "[hits]") {
  // Multiples of a power of two, which no compiler's contraction and no math library can change.
  Random random(kSeed + 2);
  const auto coordinate = [&](int exponent) {
    return std::ldexp(static_cast<float>(static_cast<std::int32_t>(random.below(1u << 21)) - (1 << 20)), exponent - 20);
  };
  const auto point = [&](int exponent) {
    return Position{coordinate(exponent), coordinate(exponent), coordinate(exponent)};
  };
  Mesh mesh;
  for (std::uint32_t i = 0; i < 3000; ++i) {
    const Position at = point(0);
    const int size = -2 - static_cast<int>(random.below(6));
    for (int k = 0; k < 3; ++k) {
      const Position offset = point(size);
      mesh.positions.push_back({at[0] + offset[0], at[1] + offset[1], at[2] + offset[2]});
    }
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const Scene scene = make_scene({mesh});
  std::vector<std::uint32_t> bits;
  const auto note = [&](float value) { bits.push_back(std::bit_cast<std::uint32_t>(value)); };
  std::size_t hits = 0;
  for (int i = 0; i < 20000; ++i) {
    const Ray ray{vec3(point(1)), 0.0f, vec3(point(0))};
    const Hit hit = default_tracer().closest(scene, ray);
    if (!hit.found()) continue;
    ++hits;
    const Vec3 next = spawn_origin(ray, hit, vec3(point(0)));
    bits.push_back(hit.primitive);
    for (const float value :
         {hit.t, hit.u, hit.v, hit.normal.x, hit.normal.y, hit.normal.z, hit.error, next.x, next.y, next.z})
      note(value);
  }
  CHECK(hits == 3961);
  std::uint64_t hash = 0xcbf29ce484222325u;  // FNV-1a, by words.
  for (const std::uint32_t word : bits) hash = (hash ^ word) * 0x100000001b3u;
  CHECK(hash == 0xe2bfa65b0c72d042u);
}
