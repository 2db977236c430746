#include <hiprt_build/pair/gpu_pair_beyond.h>

#include <hiprt_build/exec/gpu_launcher.h>

namespace hiprt::build::kernels {
namespace {

/// step(number of a single triangle, slots of the table) for each of them.
template <class Step>
__device__ void for_each_single(const PairBeyond& beyond, const BuildState* state, const std::uint32_t* singles,
                                const Step& step) {
  const std::uint32_t count = state->counts.singles, slots = beyond.slots_for(count);
  for (std::uint32_t i = thread_index(); i < count; i += gridDim.x * blockDim.x) step(singles[i], slots);
}

__global__ void __launch_bounds__(kBlock) clear_edges(PairBeyond beyond, const BuildState* state) {
  const std::uint32_t slots = beyond.slots_for(state->counts.singles);
  for (std::uint32_t i = thread_index(); i < slots; i += gridDim.x * blockDim.x) beyond.table[i] = PairBeyond::kEmpty;
}

__global__ void __launch_bounds__(kBlock)
    file_edges(PairBeyond beyond, const std::uint32_t* singles, const BuildState* state) {
  for_each_single(beyond, state, singles, [&](std::uint32_t i, std::uint32_t slots) { beyond.file(i, slots); });
}

__global__ void __launch_bounds__(kBlock)
    pair_edges(PairBeyond beyond, const std::uint32_t* singles, Reference* references, BuildState* state) {
  for_each_single(beyond, state, singles, [&](std::uint32_t i, std::uint32_t slots) {
    if (!beyond.shake_hands(i, slots, references)) return;
    fetch_add(&state->counts.pairs, 1);
    fetch_add(&state->counts.leaves, ~std::uint32_t{0});
  });
}

}  // namespace
}  // namespace hiprt::build::kernels

namespace hiprt::gpu {

using namespace build::kernels;

Result<void> enqueue_pair_beyond(const build::GeometryTable& geometries, build::Reference* references,
                                 const PairBeyondScratch& scratch, BuildState* state, hipStream_t stream) {
  const build::PairBeyond beyond{geometries, scratch.table};
  const std::uint64_t blocks = (geometries.primitive_count - 1) / kBlock + 1;
  Launcher steps(stream);
  steps.persistent("clear_edges", kBlock, blocks, clear_edges, beyond, state);
  steps.persistent("file_edges", kBlock, blocks, file_edges, beyond, scratch.singles, state);
  steps.persistent("pair_edges", kBlock, blocks, pair_edges, beyond, scratch.singles, references, state);
  return steps.result();
}

}  // namespace hiprt::gpu
