#include <hiprt_build/presplit/gpu_presplit.h>

#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/exec/gpu_launcher.h>
#include <hiprt_build/exec/gpu_scan.h>
#include <hiprt_build/presplit/gpu_presplit_kernels.h>

namespace hiprt::gpu {
namespace {

using namespace build::kernels;
using build::Reference;

/// Launches in which references with many cuts are cut once each.
constexpr unsigned kLargeLaunches = 10;
/// Fewer cuts than that are left to one thread.
constexpr std::uint32_t kManyCuts = 8;

struct Places {
  ScaleTries* tries;
  float* weights;
  std::uint32_t* places;
  std::size_t scan_bytes = 0;
  std::byte* scan;
  std::uint32_t* pending;
  std::uint32_t* count;

  Places(Arena& arena, std::uint32_t input, std::uint32_t room)
      : tries(arena.take<ScaleTries>(1)), weights(arena.take<float>(input)), places(arena.take<std::uint32_t>(input)) {
    // Only says how many bytes it needs: cannot fail.
    (void)build::exclusive_scan(nullptr, scan_bytes, nullptr, nullptr, input, nullptr, nullptr);
    scan = arena.take<std::byte>(scan_bytes);
    pending = arena.take<std::uint32_t>(room);
    count = arena.take<std::uint32_t>(1);
  }
};

}  // namespace

std::uint64_t cut_scratch(std::uint32_t input, std::uint32_t room) {
  Arena arena;
  Places(arena, input, room);
  return arena.size();
}

Result<void> enqueue_cut(const CutInput& input, Reference* parts, std::byte* scratch, hipStream_t stream) {
  BuildState* const state = input.state;
  const std::uint32_t n = input.input, room = input.room;
  const double budget = input.budget;
  Arena arena(scratch);
  Places places(arena, n, room);
  LeafParts to{input.geometries, parts, {places.pending}, 0};
  const CutPlanesOf planes{state};
  Launcher steps(stream);
  steps.fill_bytes("tries of scales", places.tries, 1, 0);
  steps.fill_bytes("parts", parts, room, 0xff);
  steps.fill_bytes("pending cuts", places.pending, room, 0);
  steps.fill_bytes("the number of parts", places.count, 1, 0);
  steps.each(n, "weigh_references", weigh_references, input.geometries, input.references, n, state, places.weights);
  for (unsigned i = 0; i < ScaleTries::kCount; ++i)
    steps.persistent("try_scale", Launcher::kBlock, (n - 1) / Launcher::kBlock + 1, try_scale, places.weights, n, state,
                     budget, i, places.tries);
  steps.each(n, "count_places", count_places, input.references, places.weights, n, state, budget, places.tries,
             places.places);
  steps.then([&] {
    return build::exclusive_scan(places.scan, places.scan_bytes, places.places, places.places, n, nullptr, stream);
  });
  steps.each(n, "place_references", place_references, input.references, places.weights, places.places, n, state, budget,
             places.tries, to);
  for (unsigned i = 0; i < kLargeLaunches; ++i) {
    ++to.now;
    steps.each(room, "cut_large", cut_large, planes, to, room, kManyCuts);
  }
  ++to.now;
  steps.each(room, "cut_rest", cut_rest, planes, to, room);
  steps.each(room, "count_parts", count_parts, parts, room, places.count);
  steps.one("set_leaves", set_leaves, places.count, state);
  return steps.result();
}

}  // namespace hiprt::gpu
