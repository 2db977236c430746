// Hits of a GPU equal the host's, bit for bit, for every layout, stack, schedule, query and filter.

#include <hiprt_build/file.h>
#include <hiprt_build/format/view.h>
#include <tests/gpu/traversal_reference.h>
#include <tests/gpu/traversal_runner.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kRaySeed = 31;
constexpr unsigned kRays = 32 * kBlock;

/// The files of make_scenes, of the seed HIPRT_GPU_SCENE_SEED; the environment names another folder, where the program
/// runs away from its build.
build::Buffer scene_file(const std::string& name, NodeLayout layout) {
  const char* folder = std::getenv("HIPRT_GPU_SCENES");
  const std::filesystem::path path = folder != nullptr ? folder : HIPRT_GPU_SCENES;
  return must(build::map_file(path / file_name(name, layout)));
}

SceneView view_of(const build::Buffer& file) { return make_scene_view(*open_buffer(file.bytes())); }

/// A scene in every layout, on host and device, with rays and what they hit.
struct TestScene {
  SceneSource source;
  std::map<NodeLayout, gpu::DeviceScene> device;
  HostResults reference;

  explicit TestScene(const SceneSource& made) : source(made) {
    static gpu::DeviceAllocator allocator;
    for (const NodeLayout layout :
         {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized}) {
      const build::Buffer file = scene_file(source.name, layout);
      device.emplace(layout, must(gpu::upload_scene(file.bytes(), nullptr, allocator)));
      must(gpu::check(hipStreamSynchronize(nullptr), "hipStreamSynchronize"));
      if (layout == NodeLayout::kPlanes) reference = make_host_results(source, view_of(file), kRays, kRaySeed);
    }
  }
  bool has(Feature feature) const { return (device.at(NodeLayout::kPlanes).view.features & feature_bit(feature)) != 0; }
};

const std::vector<std::unique_ptr<TestScene>>& all_scenes() {
  static const auto scenes = [] {
    std::vector<std::unique_ptr<TestScene>> made;
    for (const SceneSource& source : scene_sources(HIPRT_GPU_SCENE_SEED))
      made.push_back(std::make_unique<TestScene>(source));
    return made;
  }();
  return scenes;
}

struct Sum {
  unsigned rays = 0, hits = 0, different = 0;
  /// Of kernels that are not exact, and not counted in different; [1]: at edges and vertices.
  unsigned loose[2] = {}, different_loose[2] = {};
};

void print_difference(const Variant& variant, const TestScene& scene, unsigned ray, const QueryResult& result) {
  std::printf("%s, %s, ray %u: %s\n  GPU  %s, %u hits, state %d\n  host %s\n", variant.name, scene.source.name.c_str(),
              ray, text(scene.reference.rays[ray]).c_str(), text(result.hit).c_str(), result.count,
              static_cast<int>(result.state), text(scene.reference.of(variant.filter)[ray].closest).c_str());
}

void compare(const Variant& variant, const TestScene& scene, Sum& sum) {
  const SceneView& view = scene.device.at(variant.layout).view;
  const auto& expected = scene.reference.of(variant.filter);
  const Run run = Runner().run(variant, view, scene.reference.rays, view.stack_bound + kMostPushed, scene.source);
  unsigned printed = 0;
  for (unsigned i = 0; i < kRays; ++i) {
    const QueryResult& result = run.results[i];
    const bool right = variant.exact ? is_right(result, expected[i], variant.query, variant.filter, variant.depth)
                                     : is_nearly_right(result, expected[i], variant.query);
    ++sum.rays;
    sum.hits += result.hit.found();
    if (!variant.exact) {
      ++sum.loose[scene.reference.at_edge[i]];
      sum.different_loose[scene.reference.at_edge[i]] += !right;
    } else if (!right) {
      ++sum.different;
      if (++printed <= 3) print_difference(variant, scene, i, result);
    }
  }
  CHECK(run.failed_rays == 0);
  CHECK(run.broken_guards == 0);
}

/// Every kernel on every scene that it can trace; one line tells of all.
Sum compare_all(const char* axis, std::span<const Variant> variants) {
  Sum sum;
  unsigned scenes = 0;
  for (const auto& scene : all_scenes())
    for (const Variant& variant : variants) {
      if (scene->has(Feature::kCustom) != variant.custom) continue;
      INFO(axis << ": " << variant.name << ", scene " << scene->source.name);
      compare(variant, *scene, sum);
      ++scenes;
    }
  std::printf("%s: %zu kernels, %u runs, seeds %llu and %llu, %u rays, %u hits, %u differences\n", axis,
              variants.size(), scenes, static_cast<unsigned long long>(HIPRT_GPU_SCENE_SEED),
              static_cast<unsigned long long>(kRaySeed), sum.rays, sum.hits, sum.different);
  CHECK(sum.hits > sum.rays / 4);
  CHECK(sum.hits < sum.rays);
  return sum;
}

void check_axis(const char* axis, std::span<const Variant> variants) {
  CHECK(compare_all(axis, variants).different == 0);
}

bool has_ray_instruction() {
  const std::string arch = must(gpu::current_device()).architecture;
  return arch.starts_with("gfx103") || arch.starts_with("gfx110");
}

/// Of the kernels with AMD's ray instruction.
void check_hardware(const char* axis, std::span<const Variant> variants) {
  const Sum sum = compare_all(axis, variants);
  std::printf("ray instruction for triangles: %u of %u rays at edges and vertices differ, %u of %u others\n",
              sum.different_loose[1], sum.loose[1], sum.different_loose[0], sum.loose[0]);
  CHECK(sum.different == 0);
  // Tiny triangles and needles are where its rounding shows.
  CHECK(sum.different_loose[0] * 100 < sum.loose[0]);
  CHECK(sum.different_loose[1] * 3 < sum.loose[1]);
}

}  // namespace

TEST_CASE("the scenes have the features that the tests need") {
  CHECK(all_scenes()[0]->has(Feature::kMasks));
  CHECK(all_scenes()[2]->has(Feature::kSplitReferences));
  CHECK(all_scenes()[3]->has(Feature::kCustom));
}

TEST_CASE("layouts") { check_axis("layouts", layout_variants()); }
TEST_CASE("calls without policies") { check_axis("calls without policies", default_call_variants()); }
TEST_CASE("stacks") { check_axis("stacks", stack_variants()); }
TEST_CASE("schedules") { check_axis("schedules", schedule_variants()); }
TEST_CASE("queries") { check_axis("queries", query_variants()); }
TEST_CASE("filters") { check_axis("filters", filter_variants()); }
TEST_CASE("custom primitives") { check_axis("custom primitives", custom_variants()); }

TEST_CASE("a query without custom primitives refuses a scene with them") {
  const TestScene& scene = *all_scenes()[3];
  for (const Variant& variant : schedule_variants()) {
    INFO(variant.name);
    const Run run = Runner().run(variant, scene.device.at(variant.layout).view, scene.reference.rays, 1);
    for (const QueryResult& result : run.results)
      REQUIRE((result.state == TraversalState::kRefused && result.failed != 0 && !result.hit.found()));
    CHECK(run.failed_rays == 0);
  }
}

TEST_CASE("AMD's ray instruction") {
  if (has_ray_instruction())
    check_hardware("ray instruction", hardware_variants());
  else
    std::printf("ray instruction: this GPU has none\n");
}

// Each layout, stack, schedule, query, filter and kind of primitive at least once: for runs that take long per kernel.
TEST_CASE("every axis") {
  check_axis("mixed", mixed_variants());
  check_axis("custom primitives", custom_variants().last(1));
  if (has_ray_instruction()) check_hardware("ray instruction", hardware_variants().last(3));
}
