#include <hiprt_build/presplit/gpu_presplit.h>

#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/exec/gpu_launcher.h>
#include <hiprt_build/exec/gpu_scan.h>
#include <hiprt_build/presplit/gpu_presplit_kernels.h>

namespace hiprt::gpu {
namespace {

using namespace build::kernels;
using build::Reference;

/// Launches in which references with many splits are split once each.
constexpr unsigned kLargeLaunches = 10;
/// Fewer splits than that are left to one thread.
constexpr std::uint32_t kManySplits = 8;

struct PresplitScratch {
  ScaleTries* tries;
  float* weights;
  std::uint32_t* slots;
  std::size_t scan_bytes = 0;
  std::byte* scan;
  std::uint32_t* pending;
  std::uint32_t* count;

  PresplitScratch(Arena& arena, std::uint32_t input, std::uint32_t capacity)
      : tries(arena.take<ScaleTries>(1)), weights(arena.take<float>(input)), slots(arena.take<std::uint32_t>(input)) {
    // Only says how many bytes it needs: cannot fail.
    (void)build::exclusive_scan(nullptr, scan_bytes, nullptr, nullptr, input, nullptr, nullptr);
    scan = arena.take<std::byte>(scan_bytes);
    pending = arena.take<std::uint32_t>(capacity);
    count = arena.take<std::uint32_t>(1);
  }
};

}  // namespace

std::uint64_t presplit_scratch(std::uint32_t input, std::uint32_t capacity) {
  Arena arena;
  PresplitScratch(arena, input, capacity);
  return arena.size();
}

Result<void> enqueue_presplit(const PresplitInput& input, Reference* parts, std::byte* scratch, hipStream_t stream) {
  BuildState* const state = input.state;
  const std::uint32_t n = input.input, capacity = input.capacity;
  const double budget = input.budget;
  Arena arena(scratch);
  PresplitScratch slots(arena, n, capacity);
  ReferenceParts to{input.geometries, parts, {slots.pending}, 0};
  const ScenePlanes planes{state};
  Launcher steps(stream);
  steps.fill_bytes("tries of scales", slots.tries, 1, 0);
  steps.fill_bytes("parts", parts, capacity, 0xff);
  steps.fill_bytes("pending splits", slots.pending, capacity, 0);
  steps.fill_bytes("the number of parts", slots.count, 1, 0);
  steps.each(n, "weigh_references", weigh_references, input.geometries, input.references, n, state, slots.weights);
  for (unsigned i = 0; i < ScaleTries::kCount; ++i)
    steps.persistent("try_scale", Launcher::kBlock, (n - 1) / Launcher::kBlock + 1, try_scale, slots.weights, n, state,
                     budget, i, slots.tries);
  steps.each(n, "count_slots", count_slots, input.references, slots.weights, n, state, budget, slots.tries,
             slots.slots);
  steps.then([&] {
    return build::exclusive_scan(slots.scan, slots.scan_bytes, slots.slots, slots.slots, n, nullptr, stream);
  });
  steps.each(n, "scatter_input", scatter_input, input.references, slots.weights, slots.slots, n, state, budget,
             slots.tries, to);
  for (unsigned i = 0; i < kLargeLaunches; ++i) {
    ++to.now;
    steps.each(capacity, "split_large", split_large, planes, to, capacity, kManySplits);
  }
  ++to.now;
  steps.each(capacity, "split_remaining", split_remaining, planes, to, capacity);
  steps.each(capacity, "count_parts", count_parts, parts, capacity, slots.count);
  steps.one("set_leaves", set_leaves, slots.count, state);
  return steps.result();
}

Result<void> enqueue_measure_demand(const build::GeometryTable& geometries, const Reference* references,
                                    std::uint32_t count, BuildState* state, hipStream_t stream) {
  Launcher steps(stream);
  steps.persistent("measure_demand", kBlock, (count - 1) / kBlock + 1, measure_demand, geometries, references, count,
                   state);
  return steps.result();
}

}  // namespace hiprt::gpu
