/// GpuTracer in scenes of instances: hits and paths are those of trace(), bit for bit, on any levels and in motion.

#include <hiprt_build/format/only_instance.h>
#include <tests/traversal/customs/shape_scenes.h>
#include <tools/cli/build/build_names.h>
#include <tools/cli/trace_device.h>
#include <tools/render/tracers/gpu_tracer.h>

#include <algorithm>
#include <bit>

using namespace hiprt;
using namespace hiprt::tools;
using checks::InstanceScene;
using oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 417;

/// Groups of instances of earlier objects, @p levels deep.
/// @param moves whether every third instance moves.
InstanceScene random_scene(NodeLayout layout, unsigned levels, bool moves = false) {
  static const build::Motion kMotion{.keys = {{.time = 0, .translation = {1, 0, 2}},
                                              {.time = 0.4f, .rotation = {0, 0.6f, 0.8f, 1}, .scale = {1, 2, 1}},
                                              {.time = 1, .translation = {0, -2, 0}, .rotation = {1, 0, 0, 0}}}};
  Random random(kSeed);
  InstanceScene scene;
  scene.add_file({oracle::icosphere(2)}, layout);
  scene.add_file({oracle::soup(40, 0.5, kSeed), oracle::torus(12, 8, 0.4)}, layout);
  for (std::uint32_t level = 0; level < levels; ++level) {
    std::vector<build::Instance> group(8);
    for (std::uint32_t i = 0; i < group.size(); ++i)
      group[i] = {.object = i == 0 ? level + 1 : random.below(level + 2),
                  .to_scene = checks::random_affine(random, 3.0),
                  .id = 100 * level + i,
                  .motion = moves && i % 3 == 1 ? &kMotion : nullptr};
    scene.groups.push_back(group);
  }
  scene.build();
  return scene;
}

/// Into a cube of half the edge @p reach.
std::vector<Ray> random_rays(std::size_t count, double reach) {
  Random random(kSeed + 1);
  std::vector<Ray> rays(count);
  for (Ray& ray : rays) {
    const auto origin = random.in_cube(2 * reach), target = random.in_cube(reach);
    ray.origin = Vec3(origin[0], origin[1], origin[2]);
    ray.direction = Vec3(target[0], target[1], target[2]) - ray.origin;
    ray.time = random.uniform_float(-0.1, 1.1);
  }
  return rays;
}

/// Bits, so that NaN is equal to itself and 0 is not -0.
bool same(const Hit& a, const Hit& b) {
  using Words = std::array<std::uint32_t, sizeof(Hit) / 4>;
  return std::bit_cast<Words>(a) == std::bit_cast<Words>(b);
}

/// @param rays_at_once of a part.
void compare(const build::Buffer& file, Query query, TriangleTestKind triangle_test, std::size_t rays_at_once,
             double reach) {
  const BufferView view = *open_buffer(file.bytes());
  const std::vector<Ray> rays = random_rays(1500, reach);
  std::vector<Hit> cpu(rays.size()), gpu(rays.size()), without_paths(rays.size());
  std::vector<std::uint32_t> cpu_paths(rays.size() * view.header->levels), gpu_paths(cpu_paths.size());
  trace(make_scene_view(view), query, {triangle_test}, rays, cpu, {}, cpu_paths);
  auto tracer = GpuTracer::make(view, {.rays_at_once = rays_at_once});
  INFO((tracer ? "" : tracer.error().message));
  REQUIRE(tracer.has_value());
  const auto seconds = tracer->trace(query, {triangle_test}, rays, gpu, {}, gpu_paths);
  INFO((seconds ? "" : seconds.error().message));
  REQUIRE(seconds.has_value());
  CHECK(std::equal(cpu.begin(), cpu.end(), gpu.begin(), same));
  CHECK(cpu_paths == gpu_paths);
  REQUIRE(tracer->trace(query, {triangle_test}, rays, without_paths).has_value());
  CHECK(std::equal(cpu.begin(), cpu.end(), without_paths.begin(), same));
  const auto hits = std::count_if(cpu.begin(), cpu.end(), [](const Hit& hit) { return hit.found(); });
  CHECK(hits > 150);
}
void compare(const InstanceScene& scene, Query query, TriangleTestKind triangle_test, std::size_t rays_at_once) {
  compare(scene.file, query, triangle_test, rays_at_once, 3.0);
}

}  // namespace

TEST_CASE("a GPU's hits of instances, and their instance paths, are the CPU's on one level, in every layout") {
  for (const auto& [name, layout] : kLayouts) {
    CAPTURE(name);
    const InstanceScene scene = random_scene(layout, 1);
    compare(scene, Query::kClosest, TriangleTestKind::kWatertight, 1000);
    compare(scene, Query::kAny, TriangleTestKind::kWatertight, 4000);
  }
}

TEST_CASE("a GPU's hits of a scene that is one instance are the CPU's, in every layout") {
  for (const auto& [name, layout] : kLayouts) {
    CAPTURE(name);
    Random random(kSeed);
    InstanceScene scene;
    scene.add_file({oracle::soup(40, 0.5, kSeed), oracle::torus(12, 8, 0.4)}, layout);
    // What holds nothing is in no leaf, and leaves a number behind.
    scene.add_file({{}}, layout);
    scene.groups.push_back({{.object = 1}, {.object = 0, .to_scene = checks::random_affine(random, 0.1)}});
    scene.build();
    REQUIRE(only_instance(*open_buffer(std::as_const(scene.file).bytes())));
    compare(scene.file, Query::kClosest, TriangleTestKind::kWatertight, 1000, 0.8);
    compare(scene.file, Query::kAny, TriangleTestKind::kWatertight, 4000, 0.8);
  }
}

TEST_CASE("a GPU's hits on many levels, and of moving instances, are the CPU's") {
  compare(random_scene(NodeLayout::kPlanes, 3), Query::kClosest, TriangleTestKind::kWatertight, 4000);
  compare(random_scene(NodeLayout::kQuantized, 2), Query::kAny, TriangleTestKind::kWatertight, 4000);
  compare(random_scene(NodeLayout::kFloat, 2, true), Query::kClosest, TriangleTestKind::kWatertight, 4000);
  for (const auto& [name, layout] : kLayouts) {
    CAPTURE(name);
    compare(random_scene(layout, 1, true), Query::kClosest, TriangleTestKind::kWatertight, 4000);
    compare(random_scene(layout, 1, true), Query::kAny, TriangleTestKind::kWatertight, 1000);
  }
}

TEST_CASE("a GPU's hits of spheres and curves are the CPU's, flat and in instances that move") {
  const checks::ShapeObject shapes(kSeed, 30);
  for (const auto& [layout, query] :
       {std::pair{NodeLayout::kPlanes, Query::kClosest}, {NodeLayout::kQuantized, Query::kAny}})
    compare(shapes.build(layout, build::Builder::kHploc), query, TriangleTestKind::kWatertight, 1000, 0.6);
  compare(checks::ShapeScene(2, kSeed), Query::kClosest, TriangleTestKind::kWatertight, 4000);
  compare(checks::ShapeScene(1, kSeed), Query::kAny, TriangleTestKind::kWatertight, 4000);
}

TEST_CASE("a GPU's tracer refuses other triangle and box tests on many levels: auto is the CPU") {
  const InstanceScene scene = random_scene(NodeLayout::kPlanes, 2);
  const BufferView view = *open_buffer(scene.file.bytes());
  const TracePolicies fast{.triangle_test = TriangleTestKind::kFast};
  const auto refused = choose_device(DeviceChoice::kGpu, view, fast);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().message ==
        "GPU: 2 levels of instances, things that move, spheres or curves, for which there are the watertight and "
        "conservative tests only: the CPU has the others");
  const auto automatic = choose_device(DeviceChoice::kAuto, view, fast);
  REQUIRE(automatic.has_value());
  CHECK(device_word(*automatic) == "cpu");
}
