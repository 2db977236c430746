// Stacks that are too small report it, count the rays, and write only their own memory.

#include <hiprt_build/file.h>
#include <hiprt_build/format/view.h>
#include <tests/gpu/traversal_reference.h>
#include <tests/gpu/traversal_runner.h>
#include <tests/traversal/chain.h>

#include <cstdio>
#include <cstdlib>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kRaySeed = 32;
constexpr unsigned kRays = 32 * kBlock;

/// Failed and complete rays differ in their results, host and stacks count the same failures, and complete rays are
/// right.
void check_failures(const char* name, const Variant& variant, const Run& run, const HostResults& reference) {
  std::uint32_t failed = 0, wrong = 0, untold = 0;
  for (std::size_t i = 0; i < reference.rays.size(); ++i) {
    const QueryResult& result = run.results[i];
    const bool overflow = result.state == TraversalState::kStackOverflow;
    failed += overflow;
    untold += overflow != (result.failed != 0);
    // Hits before the failure are true ones.
    if (!overflow && !is_right(result, reference.plain[i], variant.query, variant.filter, variant.depth)) ++wrong;
    if (overflow && result.hit.found() && digest_of(result.hit) != digest_of(reference.plain[i].closest)) ++wrong;
  }
  std::printf("overflow, %s %s: %u of %zu rays failed, %u counted, %u wrong\n", name, variant.name, failed,
              reference.rays.size(), run.failed_rays, wrong);
  CHECK(failed > 0);
  CHECK(failed < reference.rays.size());
  CHECK(run.failed_rays == failed);
  CHECK(untold == 0);
  CHECK(wrong == 0);
  CHECK(run.broken_guards == 0);
}

}  // namespace

TEST_CASE("stacks that are too small") {
  const SceneSource source = scene_sources(HIPRT_GPU_SCENE_SEED)[0];
  const char* folder = std::getenv("HIPRT_GPU_SCENES");
  const std::filesystem::path path = folder != nullptr ? folder : HIPRT_GPU_SCENES;
  const build::Buffer file = must(build::map_file(path / file_name(source.name, NodeLayout::kPlanes)));
  gpu::DeviceAllocator allocator;
  const gpu::DeviceScene scene = must(gpu::upload_scene(file.bytes(), nullptr, allocator));
  const HostResults reference = make_host_results(source, make_scene_view(*open_buffer(file.bytes())), kRays, kRaySeed);
  for (const Variant& variant : tiny_stack_variants()) {
    INFO(variant.name);
    // Entries of global memory: with the ring of 4, as many as the other stacks have.
    const std::uint32_t entries = std::string(variant.name).starts_with("global") ? 5 : 1;
    check_failures("tiny", variant, Runner().run(variant, scene.view, reference.rays, entries), reference);
  }
}

TEST_CASE("a tree too deep for a restart trail") {
  constexpr unsigned kLevels = 80;
  const Chain chain(kLevels);
  gpu::DeviceAllocator allocator;
  const auto bytes = must(gpu::DeviceArray<std::byte>::from(chain.bytes(), nullptr, allocator));
  const auto geometry = must(gpu::DeviceArray<GeometryRecord>::from({&chain.geometry(), 1}, nullptr, allocator));
  const SceneView scene = chain.view(bytes.data(), geometry.data());
  const std::vector<Ray> rays = chain.rays();
  for (const Variant& variant : restart_variants()) {
    const Run run = Runner().run(variant, scene, rays, 1);
    std::uint32_t failed = 0;
    for (unsigned i = 0; i < kLevels; ++i) {
      INFO(variant.name << ", ray " << i);
      const bool deep = i >= kTrailLevels;
      REQUIRE((run.results[i].state == TraversalState::kStackOverflow) == deep);
      REQUIRE(run.results[i].hit.primitive == (deep ? kInvalidId : i));
      REQUIRE((run.results[i].failed != 0) == deep);
      failed += deep;
    }
    std::printf("overflow, chain of %u nodes, %s: %u rays failed, %u counted\n", kLevels, variant.name, failed,
                run.failed_rays);
    CHECK(run.failed_rays == failed);
    CHECK(run.broken_guards == 0);
  }
}
