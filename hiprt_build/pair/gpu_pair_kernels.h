#pragma once
/// The kernel that makes leaves of primitives, alone or in pairs, window by window. Internal.

#include <hiprt_build/pair/edge_table.h>
#include <hiprt_build/pair/pair_window.h>
#include <hiprt_build/pipeline/gpu_state.h>

namespace hiprt::build::kernels {

/// Adds what a block has counted, and its bounds unless it has made no leaf. For one thread of the block.
static __device__ void add_to_scene(BuildState* state, const GroupCounts& counts, const SharedBox& bounds,
                                    const SharedBox& centers) {
  if (counts.leaves != 0) {
    state->bounds.add(bounds.get());
    state->centers.add(centers.get());
    fetch_add(&state->counts.leaves, counts.leaves);
    fetch_add(&state->counts.pairs, counts.pairs);
    fetch_add(&state->counts.customs, counts.customs);
  }
  for (unsigned reason = 1; reason < 4; ++reason)
    if (counts.dropped[reason] != 0) fetch_add(&state->counts.dropped[reason], counts.dropped[reason]);
}

/// Leaves, their boxes and the scene's; each group of lanes takes a window after the other.
/// @param singles receives the triangles that stay single, in any order; may be nullptr.
static __global__ void __launch_bounds__(kGroupBlock)
    pair_primitives(PairWindow<WaveGroup> windows, Reference* references, std::uint32_t* singles,
                    GeometryRecord* records, BuildState* state) {
  __shared__ PairWindow<WaveGroup>::Shared shared[kGroupsPerBlock];
  __shared__ SharedBox bounds, centers;
  __shared__ GroupCounts counts;
  if (threadIdx.x == 0) {
    bounds.clear();
    centers.clear();
    counts = GroupCounts{};
  }
  __syncthreads();
  Box my_bounds = empty_box(), my_centers = empty_box();
  GroupCounts mine{};
  const unsigned my_group = threadIdx.x / WaveGroup::kLanes;
  const std::uint32_t all = (windows.geometries.primitive_count + kPairWindow - 1) / kPairWindow;
  for (std::uint32_t w = blockIdx.x * kGroupsPerBlock + my_group; w < all; w += gridDim.x * kGroupsPerBlock)
    windows(WaveGroup{}, shared[my_group], w, [&](const PairedPrimitive& paired) {
      const Reference reference{paired.box, paired.contents, paired.primitive};
      references[paired.primitive] = reference;
      if (singles != nullptr && EdgeTable::is_single(reference) && !windows.geometries[paired.geometry].given_pairs)
        singles[fetch_add(&state->counts.singles, 1)] = paired.primitive;
      if (paired.dropped != kKept) {
        fetch_add(&counts.dropped[paired.dropped], 1);
        atomicAdd(reinterpret_cast<unsigned long long*>(&records[paired.geometry].dropped_count), 1ull);
      }
      if (!paired.contents.exists()) return;
      grow(my_bounds, paired.box);
      grow(my_centers, split_point(paired.box));
      ++mine.leaves;
      mine.pairs += paired.contents.is_pair() ? 1 : 0;
      mine.customs += paired.contents.is_custom() ? 1 : 0;
    });
  if (my_bounds.min[0] <= my_bounds.max[0]) {
    bounds.add(my_bounds);
    centers.add(my_centers);
    fetch_add(&counts.leaves, mine.leaves);
    fetch_add(&counts.pairs, mine.pairs);
    fetch_add(&counts.customs, mine.customs);
  }
  __syncthreads();
  if (threadIdx.x == 0) add_to_scene(state, counts, bounds, centers);
}

}  // namespace hiprt::build::kernels
