// Refitted files give the hits of newly built ones, bit for bit, and their bytes do not depend on threads. Also: how
// well a refit's figures predict the work of rays.

#include <hiprt_build/exec/threads.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/refit.h>
#include <hiprt_build/statistics.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/motions.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/every_hit.h>
#include <tests/traversal/workers.h>

#include <tests/catch.h>

#include <cstring>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 90210;

Ray random_ray(const Extent& around, Random& random) {
  Ray ray;
  const Position from = random.in_cube(1.5 * around.radius), to = random.in_cube(around.radius);
  for (int k = 0; k < 3; ++k) {
    const auto center = static_cast<float>(around.center[static_cast<std::size_t>(k)]);
    ray.origin[k] = center + from[static_cast<std::size_t>(k)];
    ray.direction[k] = center + to[static_cast<std::size_t>(k)] - ray.origin[k];
  }
  return ray;
}

/// Closest hit by the default policies and the scene's layout.
Hit traced(const BufferView& view, const Ray& ray) { return closest_hit(make_scene_view(view), ray); }

BufferView refitted(Scene& scene, const std::vector<Mesh>& moved) {
  const auto views = oracle::views(moved);
  const auto result = build::refit(scene.bvh.buffer.bytes(), {views, {}});
  INFO(scene.name << ": " << (result ? "" : result.error().message));
  REQUIRE(result.has_value());
  const auto valid = validate(scene.bvh.buffer.bytes());
  INFO((valid ? "" : to_string(valid.error())));
  REQUIRE(valid);
  const auto view = open_buffer(std::as_const(scene.bvh.buffer).bytes());
  REQUIRE(view);
  return *view;
}

/// Vertices at a small number of positions: most triangles become degenerate.
Mesh collapsed(Mesh mesh) {
  for (Position& p : mesh.positions)
    for (float& x : p) x = std::round(x);
  return mesh;
}

std::vector<Mesh> each(const std::vector<Mesh>& meshes, const std::function<Mesh(const Mesh&)>& motion) {
  std::vector<Mesh> result(meshes.size());
  std::transform(meshes.begin(), meshes.end(), result.begin(), motion);
  return result;
}

}  // namespace

TEST_CASE("hits of refitted files are those of brute force and of fresh builds, bit for bit", "[refit]") {
  INFO("seed " << kSeed);
  const std::vector<Mesh> meshes{star(2, kSeed), soup(150, 0.8, kSeed), grid_plane(6, 1, 0.25f)};
  std::vector<Scene> scenes = all_scenes(meshes);
  const std::vector<std::vector<Mesh>> motions{each(meshes, [](const Mesh& m) { return twisted(m, 0.4); }),
                                               each(meshes, [](const Mesh& m) { return shaken(m, 0.7, kSeed); }),
                                               each(meshes, [](const Mesh& m) { return collapsed(m); }),
                                               each(meshes,
                                                    [](const Mesh& m) {
                                                      return placed(m, 1e5, {1e6, 0, -1e5});
                                                    }),
                                               each(meshes, [](const Mesh& m) { return placed(m, 1e-12); }),
                                               meshes};
  Random random(kSeed);
  unsigned found = 0;
  for (const std::vector<Mesh>& moved : motions) {
    std::vector<BufferView> views(scenes.size());
    for (std::size_t s = 0; s < scenes.size(); ++s) views[s] = refitted(scenes[s], moved);
    const Scene fresh = make_scene(moved);
    for (unsigned i = 0; i < trials(300) + 20; ++i) {
      const Ray ray = random_ray(extent(moved[random.below(3)]), random);
      const std::vector<Hit> hits = every_hit(moved, ray);
      const Hit expected = hits.empty() ? Hit{} : hits[0];
      found += hits.empty() ? 0 : 1;
      REQUIRE(same_hit(traced(fresh.view, ray), expected));
      for (std::size_t s = 0; s < scenes.size(); ++s)
        if (!same_hit(traced(views[s], ray), expected)) {
          FAIL(scenes[s].name << ", ray " << i << ": t=" << traced(views[s], ray).t << ", not " << expected.t);
        }
    }
  }
  CHECK(found > 100);
}

TEST_CASE("a refit with other indices is refused and changes nothing, or has the hits of brute force", "[refit]") {
  INFO("seed " << kSeed);
  Random random(kSeed);
  const Mesh mesh = icosphere(3);
  const auto shuffled = [&](auto& values) {
    for (std::size_t i = values.size(); i-- > 1;)
      std::swap(values[i], values[random.below(static_cast<std::uint32_t>(i + 1))]);
  };
  Mesh turned = mesh, reordered = mesh, rewired = mesh, renumbered = mesh;
  for (auto& t : turned.triangles) t = {t[1], t[2], t[0]};
  shuffled(reordered.triangles);
  for (auto& t : rewired.triangles)
    for (auto& corner : t) corner = random.below(static_cast<std::uint32_t>(mesh.positions.size()));
  shuffled(renumbered.positions);
  unsigned refused = 0, found = 0;
  for (const bool pairs : {true, false})
    for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized})
      for (const Mesh& other : {turned, reordered, rewired, renumbered}) {
        CAPTURE(pairs, static_cast<std::uint32_t>(layout));
        Scene scene = make_scene({mesh}, {.nodes = layout, .pair_triangles = pairs});
        const std::vector<std::byte> before(scene.view.bytes.begin(), scene.view.bytes.end());
        const std::vector<Mesh> now{other};
        if (!build::refit(scene.bvh.buffer.bytes(), {oracle::views(now), {}})) {
          REQUIRE(pairs);
          REQUIRE(std::equal(before.begin(), before.end(), scene.view.bytes.begin()));
          ++refused;
          continue;
        }
        const BufferView view = *open_buffer(std::as_const(scene.bvh.buffer).bytes());
        REQUIRE(validate(view.bytes));
        for (unsigned i = 0; i < 40; ++i) {
          const Ray ray = random_ray(extent(other), random);
          const std::vector<Hit> hits = every_hit(now, ray);
          found += hits.empty() ? 0 : 1;
          REQUIRE(same_hit(traced(view, ray), hits.empty() ? Hit{} : hits[0]));
        }
      }
  CHECK((refused >= 8 && found > 300));
}

TEST_CASE("refitted files do not depend on the number of threads", "[refit]") {
  // More threads than the machine may have, so that they are interrupted at any point.
  const build::Threads::Limit workers(8);
  const std::vector<Mesh> meshes{icosphere(trials(100) > 4 ? 6 : 5), soup(trials(60000), 0.05, 2), identical(3000)};
  const std::vector<Mesh> moved = each(meshes, [](const Mesh& m) { return placed(twisted(m, 0.3), 1e5); });
  const auto moved_views = oracle::views(moved);
  for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized}) {
    CAPTURE(static_cast<std::uint32_t>(layout));
    const Scene scene = make_scene(meshes, {.builder = build::Builder::kLbvh, .nodes = layout});
    const auto bytes = [&](unsigned threads) {
      auto result = build::refit_copy(scene.view.bytes, {moved_views, {}}, {.threads = threads});
      REQUIRE(result.has_value());
      return std::pair(std::move(result->buffer), result->statistics);
    };
    const auto [one, figures] = bytes(1);
    REQUIRE(validate(one.bytes()));
    for (const unsigned threads : {2u, 8u, 8u}) {
      const auto [many, same] = bytes(threads);
      REQUIRE(one.size() == many.size());
      CHECK(std::memcmp(one.bytes().data(), many.bytes().data(), one.size()) == 0);
      CHECK(same.sah_cost == figures.sah_cost);
      CHECK(same.exchange_slack == figures.exchange_slack);
    }
  }
}

namespace {

struct Motion {
  std::string name;
  Mesh mesh;
};

/// @param whole triangles that share vertices. The moved meshes have vertices of their own.
std::vector<Motion> motions_of(const Mesh& whole) {
  const Mesh mesh = unshared(whole);
  std::vector<Motion> result{{"none", mesh}, {"grow 10 x", placed(mesh, 10)}};
  const auto add = [&](const char* name, double amount, Mesh moved) {
    char text[32];
    std::snprintf(text, sizeof(text), "%s %g", name, amount);
    result.push_back({text, std::move(moved)});
  };
  for (const double amount : {0.1, 0.25, 0.5, 1.0}) add("twist", amount, twisted(mesh, amount));
  for (const double amount : {0.3, 1.0, 3.0}) add("wave", amount, waved(mesh, amount));
  for (const double amount : {0.03, 0.1, 0.3, 1.0}) add("shake", amount, unshared(shaken(whole, amount, kSeed)));
  for (const double amount : {0.1, 0.2, 1.0, 5.0}) add("explode", amount, exploded(mesh, amount, kSeed));
  for (const double amount : {1e-4, 1e-3, 1e-2}) add("scatter", amount, scattered(mesh, amount, 3, kSeed));
  return result;
}

/// From random points of triangles in all directions, as bounces of a renderer.
std::vector<Ray> bounces(const Mesh& mesh, unsigned count) {
  Random random(kSeed);
  std::vector<Ray> rays(count);
  for (Ray& ray : rays) {
    const Corners c = corners(mesh, random.below(static_cast<std::uint32_t>(mesh.triangles.size())));
    const double r = std::sqrt(random.unit()), s = r * random.unit();
    const Double3 direction = random.on_sphere();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<int>(k);
      ray.origin[axis] =
          static_cast<float>((1 - r) * double{c.p0[k]} + (r - s) * double{c.p1[k]} + s * double{c.p2[k]});
      ray.direction[axis] = static_cast<float>(direction[k]);
    }
  }
  return rays;
}

/// Four-box tests and, at 0.8 of their cost, leaf tests per ray.
double work(std::span<const std::byte> file, const std::vector<Ray>& rays) {
  const auto view = open_buffer(file);
  REQUIRE(view);
  const SceneView scene = make_scene_view(*view);
  double sum = 0;
  for (const Ray& ray : rays) {
    PrivateStack<>::Memory memory;
    ClosestHit<Tried<PlanesLayout>> query(scene, ray, memory);
    query.next_hit();
    sum += query.counter().box_tests + 0.8 * query.counter().leaf_tests;
  }
  return sum / static_cast<double>(rays.size());
}

}  // namespace

// test_refit_hits "[motions]" prints the table of decision 0012.
TEST_CASE("the figures of a refit compared with the work of rays (printed)", "[.][motions]") {
  constexpr unsigned kRays = 20000;
  std::printf(
      "| scene | motion | cost ratio | slack growth | advice | work: refitted / fresh | fresh / built |\n"
      "|---|---|---:|---:|---|---:|---:|\n");
  for (const auto& [name, mesh] :
       {std::pair("star", star(6, 5)), std::pair("torus", torus(300, 100, 0.4)),
        std::pair("soup", soup(30000, 0.05, 6)), std::pair("plane", grid_plane(100, 2, 0.5f))}) {
    const build::BuildOptions options{.pair_triangles = false};
    const Scene scene = make_scene({unshared(mesh)}, options);
    const double built = work(scene.view.bytes, bounces(unshared(mesh), kRays));
    for (const Motion& motion : motions_of(mesh)) {
      const std::vector meshes{motion.mesh.view()};
      const auto moved = build::refit_copy(scene.view.bytes, {meshes, {}});
      REQUIRE(moved.has_value());
      const Scene fresh = make_scene({motion.mesh}, options);
      const std::vector<Ray> rays = bounces(motion.mesh, kRays);
      const double refitted_work = work(moved->buffer.bytes(), rays), fresh_work = work(fresh.view.bytes, rays);
      const build::RefitStatistics& s = moved->statistics;
      std::printf("| %s | %s | %.2f | %.3f | %s | %.2f | %.2f |\n", name, motion.name.c_str(), s.cost_ratio,
                  s.exchange_slack - s.exchange_slack_built, s.rebuild_advised ? "rebuild" : "",
                  refitted_work / fresh_work, fresh_work / built);
    }
  }
}
