#include <hiprt_build/pair/gpu_edge_table.h>

#include <hiprt_build/exec/gpu_launcher.h>

namespace hiprt::build::kernels {
namespace {

/// step(number of a single triangle, slots of the table) for each of them.
template <class Step>
__device__ void for_each_single(const EdgeTable& table, const BuildState* state, const std::uint32_t* singles,
                                const Step& step) {
  const std::uint32_t count = state->counts.singles, slots = table.slots_for(count);
  for (std::uint32_t i = thread_index(); i < count; i += gridDim.x * blockDim.x) step(singles[i], slots);
}

__global__ void __launch_bounds__(kBlock) clear_edges(EdgeTable table, const BuildState* state) {
  const std::uint32_t slots = table.slots_for(state->counts.singles);
  for (std::uint32_t i = thread_index(); i < slots; i += gridDim.x * blockDim.x) table.table[i] = EdgeTable::kEmpty;
}

__global__ void __launch_bounds__(kBlock)
    insert_edges(EdgeTable table, const std::uint32_t* singles, const BuildState* state) {
  for_each_single(table, state, singles, [&](std::uint32_t i, std::uint32_t slots) { table.insert(i, slots); });
}

__global__ void __launch_bounds__(kBlock)
    pair_edges(EdgeTable table, const std::uint32_t* singles, Reference* references, BuildState* state) {
  for_each_single(table, state, singles, [&](std::uint32_t i, std::uint32_t slots) {
    if (!table.shake_hands(i, slots, references)) return;
    fetch_add(&state->counts.pairs, 1);
    fetch_add(&state->counts.leaves, ~std::uint32_t{0});
  });
}

}  // namespace
}  // namespace hiprt::build::kernels

namespace hiprt::gpu {

using namespace build::kernels;

Result<void> enqueue_pair_by_edges(const build::GeometryTable& geometries, build::Reference* references,
                                   const EdgeTableScratch& scratch, BuildState* state, hipStream_t stream) {
  const build::EdgeTable table{geometries, scratch.table};
  const std::uint64_t blocks = (geometries.primitive_count - 1) / kBlock + 1;
  Launcher steps(stream);
  steps.persistent("clear_edges", kBlock, blocks, clear_edges, table, state);
  steps.persistent("insert_edges", kBlock, blocks, insert_edges, table, scratch.singles, state);
  steps.persistent("pair_edges", kBlock, blocks, pair_edges, table, scratch.singles, references, state);
  return steps.result();
}

}  // namespace hiprt::gpu
