#include <hiprt_build/src/gpu_pair_beyond.h>

#include <hiprt_build/src/gpu_launcher.h>

namespace hiprt::build::kernels {
namespace {

/// step(number of a single triangle, how many there are) for each of them.
template <class Step>
__device__ void for_each_single(const BuildState* state, const std::uint32_t* singles, const Step& step) {
  const std::uint32_t count = state->counts.singles;
  for (std::uint32_t i = thread_index(); i < count; i += gridDim.x * blockDim.x) step(singles[i], count);
}

__global__ void __launch_bounds__(kBlock) clear_edges(PairBeyond beyond, const BuildState* state) {
  const std::uint32_t slots = PairBeyond::kSlots * state->counts.singles;
  for (std::uint32_t i = thread_index(); i < slots; i += gridDim.x * blockDim.x) beyond.table[i] = kInvalidId;
}

__global__ void __launch_bounds__(kBlock)
    file_edges(PairBeyond beyond, const std::uint32_t* singles, const BuildState* state) {
  for_each_single(state, singles, [&](std::uint32_t i, std::uint32_t count) { beyond.file(i, count); });
}

__global__ void __launch_bounds__(kBlock)
    choose_partners(PairBeyond beyond, const std::uint32_t* singles, bool first, const BuildState* state) {
  for_each_single(state, singles, [&](std::uint32_t i, std::uint32_t count) {
    if (first) beyond.find_partners(i, count);
    beyond.choose(i);
  });
}

__global__ void __launch_bounds__(kBlock)
    pair_partners(PairBeyond beyond, const std::uint32_t* singles, BuildState* state) {
  for_each_single(state, singles, [&](std::uint32_t i, std::uint32_t) {
    if (!beyond.shake_hands(i)) return;
    fetch_add(&state->counts.pairs, 1);
    fetch_add(&state->counts.leaves, ~std::uint32_t{0});
  });
}

}  // namespace
}  // namespace hiprt::build::kernels

namespace hiprt::gpu {

using namespace build::kernels;

Result<void> enqueue_pair_beyond(const build::SoupView& soup, build::LeafReference* references,
                                 const PairBeyondScratch& scratch, BuildState* state, hipStream_t stream) {
  const build::PairBeyond beyond{soup, references, scratch.table, scratch.partners, scratch.choices};
  const std::uint64_t blocks = (soup.primitives - 1) / kBlock + 1;
  Launcher steps(stream);
  steps.persistent("clear_edges", kBlock, blocks, clear_edges, beyond, state);
  steps.persistent("file_edges", kBlock, blocks, file_edges, beyond, scratch.singles, state);
  for (unsigned round = 0; round < build::kBeyondRounds; ++round) {
    steps.persistent("choose_partners", kBlock, blocks, choose_partners, beyond, scratch.singles, round == 0, state);
    steps.persistent("pair_partners", kBlock, blocks, pair_partners, beyond, scratch.singles, state);
  }
  return steps.result();
}

}  // namespace hiprt::gpu
