// The eight-wide nodes of a host: where there are some, that they hold the scene's leaves, and that hits are the same.

#include <hiprt_build/host/host_node.h>
#include <hiprt_build/host/isa.h>
#include <hiprt_build/open_scene.h>
#include <hiprt_build/refit.h>
#include <hiprt_build/trace_rays.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/host_scene.h>
#include <tests/amount.h>
#include <tests/host/soups.h>
#include <tests/traversal/tracers.h>

#include <tests/catch.h>

#include <algorithm>
#include <map>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 808;

bool host_has_tracer() {
#if defined(__x86_64__)
  return format_detail::runs_isa("x86_64_v3");
#else
  return false;
#endif
}

/// @return what differs from the scene's own nodes, or "".
std::string difference(const SceneView& scene, const Ray& ray) {
  const Hit expected = closest_hit<Policies>(scene, ray), hit = closest_hit(scene, ray);
  if (!same_hit(hit, expected))
    return "closest: t " + std::to_string(hit.t) + " primitive " + std::to_string(hit.primitive) + ", expected " +
           std::to_string(expected.t) + " " + std::to_string(expected.primitive);
  const Hit any = any_hit(scene, ray);
  if (any.found() != expected.found()) return std::string("any: ") + (any.found() ? "found" : "missed");
  return "";
}

void check_hits(const SceneView& scene, Random& random, unsigned rays, double scale) {
  for (unsigned i = 0; i < rays; ++i) {
    const Ray ray = random_ray(random, scale);
    INFO("ray " << i);
    REQUIRE(difference(scene, ray) == "");
  }
}

/// The leaves that the host's nodes name, each with how often.
std::map<std::uint64_t, unsigned> named_leaves(const SceneView& scene) {
  std::map<std::uint64_t, unsigned> leaves;
  std::vector<const HostNode*> open{scene.host->nodes};
  while (!open.empty()) {
    const HostNode& node = *open.back();
    open.pop_back();
    for (const HostRef child : node.child) {
      if (child.is_none()) continue;
      if (child.is_node()) {
        open.push_back(child.node());
        continue;
      }
      const PlanesLeaf* leaf = child.leaves();
      for (unsigned left = child.is_long_run() ? ~0u : child.leaf_count(); left > 0; --left, ++leaf) {
        ++leaves[static_cast<std::uint64_t>(reinterpret_cast<const std::byte*>(leaf) - scene.base)];
        if (child.is_long_run() && (leaf->info.geometry_and_flags & kLastInRun) != 0) break;
      }
    }
  }
  return leaves;
}

}  // namespace

TEST_CASE("A host has nodes of its own for flat scenes of triangles in layout planes") {
  Random random(kSeed);
  const std::vector<Mesh> meshes{soup(random, 200, 0.1)};
  const Scene planes = make_scene(meshes);
  CHECK((planes.traced.host != nullptr) == host_has_tracer());
  CHECK(make_scene_view(planes.view).host == nullptr);
  for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kHalf, NodeLayout::kQuantized})
    CHECK(make_scene(meshes, {.nodes = layout}).traced.host == nullptr);
  const std::vector<Mesh> one{soup(random, 1, 0.1)};
  CHECK(make_scene(one, {.max_leaf_triangles = 8}).traced.host == nullptr);
  const auto file = open_scene(planes.view.bytes, "soup");
  REQUIRE(file);
  CHECK((file->scene().host != nullptr) == host_has_tracer());
}

TEST_CASE("The host's nodes name every leaf of the file once") {
  if (!host_has_tracer()) {
    WARN("skipped: this processor has no AVX2");
    return;
  }
  Random random(kSeed + 1);
  const std::vector<Mesh> meshes{soup(random, 3000, 0.2)};
  for (const auto& [word, builder] : tools::kBuilders)
    for (const unsigned most : {1u, 8u, 64u}) {
      const Scene scene = make_scene(meshes, {.builder = builder, .max_leaf_triangles = most});
      INFO(scene.name);
      REQUIRE(scene.traced.host != nullptr);
      const auto leaves = named_leaves(scene.traced);
      CHECK(leaves.size() == scene.view.leaves.count);
      for (const auto& [offset, count] : leaves) REQUIRE(count == 1);
    }
}

TEST_CASE("Hits by the host's nodes are those of the file's nodes, bit for bit") {
  INFO("seed " << kSeed);
  Random random(kSeed + 2);
  for (const double size : {0.02, 0.2, 1.0})
    for (const bool pair : {true, false}) {
      const std::vector<Mesh> meshes{soup(random, 1500, size), soup(random, 100, size)};
      for (const unsigned most : {1u, 4u, 64u}) {
        const Scene scene = make_scene(meshes, {.max_leaf_triangles = most, .pair_triangles = pair});
        INFO(scene.name << ", triangles of " << size);
        check_hits(scene.traced, random, trials(2000), 1.0);
      }
      const Scene split = make_scene(meshes, {.builder = build::Builder::kSbvh, .pair_triangles = pair});
      INFO(split.name << ", triangles of " << size);
      check_hits(split.traced, random, trials(2000), 1.0);
    }
}

TEST_CASE("Hits by the host's nodes are the same at every size and place") {
  INFO("seed " << kSeed);
  Random random(kSeed + 3);
  const Mesh mesh = soup(random, 500, 0.1);
  for (const double scale : {1e-38, 1e-20, 1e-6, 1e6, 1e18, 1e37}) {
    const Scene scene = make_scene({placed(mesh, scale)});
    INFO("scale " << scale);
    check_hits(scene.traced, random, trials(1000), scale);
  }
  const Scene far = make_scene({placed(mesh, 1.0, {1e6, -1e5, 1e4})});
  for (unsigned i = 0; i < trials(1000); ++i) {
    Ray ray = random_ray(random, 1.0);
    ray.origin += Vec3(1e6f, -1e5f, 1e4f);
    REQUIRE(difference(far.traced, ray) == "");
  }
}

TEST_CASE("Hits at the ends of rays are the same, bit for bit") {
  INFO("seed " << kSeed);
  Random random(kSeed + 7);
  const Mesh mesh = soup(random, 500, 0.3);
  // Beyond 2^40 no triangle is rejected by its depth alone.
  for (const double scale : {1e-25, 1e-6, 1.0, 1e9, 0x1p39, 0x1p42, 1e18}) {
    const Scene scene = make_scene({placed(mesh, scale)});
    unsigned found = 0;
    for (unsigned i = 0; i < trials(2000); ++i) {
      Ray ray = random_ray(random, scale);
      // Within the range of ray.h: t is then down to 2^-135.
      const double exponent = std::log2(scale);
      const double length =
          std::exp2(random.uniform(std::max(-90.0, exponent - 80.0), std::min(115.0, exponent + 95.0)) - exponent);
      for (int k = 0; k < 3; ++k) ray.direction[k] = static_cast<float>(ray.direction[k] * length);
      ray.tmin = 0.0f;
      ray.tmax = std::numeric_limits<float>::infinity();
      INFO("scale " << scale << ", ray " << i << ", direction times " << length);
      REQUIRE(difference(scene.traced, ray) == "");
      const Hit hit = closest_hit<Policies>(scene.traced, ray);
      if (!hit.found()) continue;
      ++found;
      // The end on the hit, and next to it.
      for (const float t : {hit.t, std::nextafter(hit.t, 0.0f), std::nextafter(hit.t, ray.tmax), 0.999f * hit.t}) {
        Ray later = ray, shorter = ray;
        later.tmin = t;
        shorter.tmax = t;
        REQUIRE(difference(scene.traced, later) == "");
        REQUIRE(difference(scene.traced, shorter) == "");
      }
      // From the hit point, within rounding, and from a spawned origin.
      Ray bounce = random_ray(random, scale);
      for (const bool spawned : {false, true}) {
        bounce.origin = spawned ? spawn_origin(ray, hit, bounce.direction) : Vec3{};
        if (!spawned)
          for (int k = 0; k < 3; ++k) bounce.origin[k] = ray.origin[k] + hit.t * ray.direction[k];
        for (const float tmin : {0.0f, 1e-3f, bounce.tmin}) {
          bounce.tmin = tmin;
          REQUIRE(difference(scene.traced, bounce) == "");
        }
      }
    }
    CHECK(found > trials(2000) / 20);
  }
}

TEST_CASE("Needles along a ray are hit at the same places, though their edge functions underflow") {
  INFO("seed " << kSeed);
  Random random(kSeed + 8);
  for (const double width : {0x1p-78, 0x1p-74, 0x1p-70, 0x1p-50}) {
    Mesh mesh;
    for (unsigned i = 0; i < 200; ++i) {
      Position corner[3];
      for (Position& p : corner) {
        p = random.in_cube(width);
        p[2] = random.uniform_float(0.5, 2.0);
      }
      append(mesh, corner[0], corner[1], corner[2]);
    }
    const Scene scene = make_scene({mesh});
    unsigned found = 0;
    for (unsigned i = 0; i < trials(2000); ++i) {
      const Position from = random.in_cube(0.1 * width);
      Ray ray;
      ray.origin = {from[0], from[1], random.coin() ? 0.0f : 3.0f};
      ray.direction = {0.0f, 0.0f, ray.origin.z == 0.0f ? 1.0f : -1.0f};
      ray.tmin = random.uniform_float(0.5, 2.0);
      INFO("width " << width << ", ray " << i);
      REQUIRE(difference(scene.traced, ray) == "");
      found += any_hit(scene.traced, ray).found() ? 1 : 0;
    }
    CHECK(found > trials(2000) / 4);
  }
}

TEST_CASE("Hits are the same where tmin is below the normal range") {
  INFO("seed " << kSeed);
  Random random(kSeed + 9);
  // Wide triangles at depths of about 2^-36.
  Mesh mesh = soup(random, 200, 0.5);
  for (Position& p : mesh.positions) p[2] *= 0x1p-36f;
  const Scene scene = make_scene({mesh});
  unsigned found = 0;
  for (unsigned i = 0; i < trials(2000); ++i) {
    const Position from = random.in_cube(1.0);
    Ray ray;
    ray.origin = {from[0], from[1], -0x1p-35f};
    ray.direction = {0.0f, 0.0f, 0x1p99f};
    ray.tmin = 0.0f;
    ray.tmax = std::numeric_limits<float>::infinity();
    const Hit hit = closest_hit<Policies>(scene.traced, ray);
    if (!hit.found() || !(hit.t < std::numeric_limits<float>::min())) continue;
    ++found;
    for (const float tmin : {hit.t, std::nextafter(hit.t, 0.0f), std::nextafter(hit.t, ray.tmax)}) {
      ray.tmin = tmin;
      INFO("ray " << i << ", tmin " << tmin);
      REQUIRE(difference(scene.traced, ray) == "");
    }
  }
  CHECK(found > trials(2000) / 20);
}

TEST_CASE("Many rays at once have the hits of single rays") {
  INFO("seed " << kSeed);
  Random random(kSeed + 6);
  const std::vector<Mesh> meshes{soup(random, 3000, 0.1)};
  std::vector<Scene> scenes;
  for (const NodeLayout layout : {NodeLayout::kPlanes, NodeLayout::kHalf})
    scenes.push_back(make_scene(meshes, {.nodes = layout}));
  scenes.push_back(make_scene({soup(random, 1, 0.5)}));
  for (const Scene& scene : scenes)
    for (const std::size_t count : {0u, 1u, 7u, 8u, 9u, 64u, 5000u}) {
      INFO(scene.name << ", " << count << " rays");
      std::vector<Ray> rays;
      while (rays.size() < count) {
        // Some windows are coherent, some rays can hit nothing.
        const unsigned kind = random.below(8);
        Ray ray = random_ray(random, 1.0);
        if (kind == 0) ray.direction.x = std::numeric_limits<float>::quiet_NaN();
        for (unsigned i = 0; i < (kind < 4 ? 1u : 11u) && rays.size() < count; ++i) {
          if (i > 0) ray.direction.y *= 1.001f;
          rays.push_back(ray);
        }
      }
      std::vector<Hit> hits(count), any(count + 1);
      REQUIRE(closest_hits(scene.traced, rays, hits));
      REQUIRE(any_hits(scene.traced, rays, any));
      for (std::size_t i = 0; i < count; ++i) {
        INFO("ray " << i);
        REQUIRE(same_hit(hits[i], closest_hit<Policies>(scene.traced, rays[i])) ==
                (scene.traced.layout == NodeLayout::kPlanes));
        REQUIRE(same_hit(hits[i], closest_hit(scene.traced, rays[i])));
        REQUIRE(any[i].found() == any_hit(scene.traced, rays[i]).found());
      }
    }
}

TEST_CASE("After a refit the file's nodes are traced, and the next view has new nodes") {
  INFO("seed " << kSeed);
  Random random(kSeed + 4);
  Mesh mesh = soup(random, 1000, 0.1);
  auto bvh = build::build(std::vector{mesh.view()});
  REQUIRE(bvh);
  const SceneView before = bvh->scene();
  for (Position& p : mesh.positions)
    for (float& x : p) x += random.uniform_float(-0.5, 0.5);
  REQUIRE(build::refit(bvh->buffer.bytes(), {std::vector{mesh.view()}, {}}));
  SceneView moved = before;
  moved.bounds = open_buffer(std::as_const(bvh->buffer).bytes())->header->bounds;
  CHECK(current_host_scene(moved) == nullptr);
  check_hits(moved, random, trials(1000), 1.5);
  const SceneView after = bvh->scene();
  CHECK((current_host_scene(after) != nullptr) == host_has_tracer());
  check_hits(after, random, trials(1000), 1.5);
  check_hits(moved, random, trials(1000), 1.5);
}
