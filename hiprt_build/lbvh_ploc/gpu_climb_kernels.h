#pragma once
/// Kernels that sort leaves along a Morton curve and join them from the leaves to the root. Internal.

#include <hiprt_build/exec/gpu_scan.h>
#include <hiprt_build/lbvh_ploc/hploc.h>
#include <hiprt_build/lbvh_ploc/lbvh.h>
#include <hiprt_build/lbvh_ploc/morton.h>
#include <hiprt_build/pipeline/gpu_state.h>

namespace hiprt::build::kernels {

/// Keys of primitives that are not the first of a leaf come last.
static __global__ void __launch_bounds__(kBlock)
    make_keys(const Reference* references, std::uint32_t count, unsigned bits, const BuildState* state,
              std::uint64_t* keys, std::uint32_t* values) {
  const std::uint32_t i = thread_index();
  if (i >= count) return;
  const Reference reference = references[i];
  const MortonGrid grid = MortonGrid::over(state->centers.get(), bits);
  keys[i] = reference.contents.exists() ? grid.code(reference.box) : ~std::uint64_t{0};
  values[i] = i;
}

/// Keys of the references that exist, in their order, one behind the other. One block per tile.
static __global__ void __launch_bounds__(kBlock)
    pack_keys(const Reference* references, std::uint32_t count, unsigned bits, const BuildState* state, TileSums tiles,
              std::uint64_t* keys, std::uint32_t* values) {
  constexpr unsigned kGroups = kBlock / WaveGroup::kLanes, kCounts = kPackRows * kGroups;
  __shared__ std::uint32_t before[kCounts], my_tile, before_tile;
  const WaveGroup group;
  if (threadIdx.x == 0) my_tile = tiles.take();
  __syncthreads();
  const std::uint32_t tile = my_tile, first = tile * kPackTile + threadIdx.x,
                      my_group = threadIdx.x / WaveGroup::kLanes;
  const MortonGrid grid = MortonGrid::over(state->centers.get(), bits);
  std::uint64_t mine[kPackRows];
  std::uint32_t there[kPackRows];  // Lanes of the group whose reference exists.
  for (unsigned row = 0; row < kPackRows; ++row) {
    const std::uint32_t i = first + row * kBlock;
    Reference reference{};
    reference.contents = LeafContents::none();
    if (i < count) reference = references[i];
    there[row] = group.ballot(reference.contents.exists());
    mine[row] = reference.contents.exists() ? grid.code(reference.box) : 0;
    if (group.lane() == 0) before[row * kGroups + my_group] = lane_count(there[row]);
  }
  __syncthreads();
  if (threadIdx.x < WaveGroup::kLanes) {
    std::uint32_t sum = 0;
    for (unsigned begin = 0; begin < kCounts; begin += WaveGroup::kLanes) {
      std::uint32_t total = 0;
      const std::uint32_t earlier = group_scan(group, before[begin + group.lane()], total);
      before[begin + group.lane()] = sum + earlier;
      sum += total;
    }
    const std::uint32_t earlier = tiles.before(group, tile, sum);
    if (threadIdx.x == 0) before_tile = earlier;
  }
  __syncthreads();
  for (unsigned row = 0; row < kPackRows; ++row) {
    if ((there[row] >> group.lane() & 1u) == 0) continue;
    const std::uint32_t to =
        before_tile + before[row * kGroups + my_group] + lane_count(there[row] & ((1u << group.lane()) - 1));
    keys[to] = mine[row];
    values[to] = first + row * kBlock;
  }
}

static __global__ void clear_centers(BuildState* state) { state->centers.clear(); }
/// Of all references.
static __global__ void __launch_bounds__(kBlock)
    bound_centers(const Reference* references, std::uint32_t count, BuildState* state) {
  __shared__ SharedBox centers;
  if (threadIdx.x == 0) centers.clear();
  __syncthreads();
  Box mine = empty_box();
  for (std::uint32_t i = thread_index(); i < count; i += gridDim.x * blockDim.x)
    if (references[i].contents.exists()) grow(mine, split_point(references[i].box));
  if (mine.min[0] <= mine.max[0]) centers.add(mine);
  __syncthreads();
  if (threadIdx.x == 0 && !centers.empty()) state->centers.add(centers.get());
}

static __global__ void __launch_bounds__(kBlock)
    gather_leaves(const Reference* references, const std::uint64_t* keys, const std::uint32_t* order,
                  const BuildState* state, SortedLeaves sorted) {
  const std::uint32_t i = thread_index(), count = state->counts.leaves;
  if (i >= count) return;
  const Reference reference = references[order[i]];
  sorted.references[i] = reference;
  sorted.primitives[i] = LeafPrimitives{reference.primitive, reference.contents};
  sorted.met[i] = kInvalidId;
  if (i + 1 < count) sorted.levels[i] = boundary_level(keys[i], keys[i + 1], i);
}

static __global__ void __launch_bounds__(kBlock)
    climb_lbvh(PlannedTree tree, SortedLeaves sorted, const BuildState* state) {
  const std::uint32_t i = thread_index();
  if (i < state->counts.leaves) LbvhStep<PlannedTree>{tree, state->counts.leaves, sorted.levels, sorted.met}(i);
}

static __global__ void __launch_bounds__(kGroupBlock)
    climb_hploc(PlannedTree tree, SortedLeaves sorted, KeptCluster* kept, std::uint32_t radius,
                const BuildState* state) {
  using Climber = Hploc<WaveGroup, PlannedTree>;
  __shared__ Climber::Shared shared[kGroupsPerBlock];
  const Climber climber{tree, state->counts.leaves, sorted.levels, sorted.met, kept, radius};
  climber(WaveGroup{}, shared[threadIdx.x / WaveGroup::kLanes], thread_index());
}

/// Whether the tree must be made again: the climbs have to begin anew. Few threads, because it seldom must.
static __global__ void __launch_bounds__(kBlock)
    check_depth(const CollapsePlan* plans, SortedLeaves sorted, BuildState* state) {
  const LinkedRef root = state->root;
  if (state->counts.leaves == 0 || (root & kLinkedLeaf) != 0 || plans[root].need <= kMaxStackBound) return;
  for (std::uint32_t i = thread_index(); i < state->counts.leaves; i += gridDim.x * blockDim.x)
    sorted.met[i] = kInvalidId;
  if (thread_index() == 0) state->too_deep = 1;
}
static __global__ void __launch_bounds__(kBlock)
    lbvh_again(PlannedTree tree, SortedLeaves sorted, const BuildState* state) {
  if (state->too_deep == 0) return;
  for (std::uint32_t i = thread_index(); i < state->counts.leaves; i += gridDim.x * blockDim.x)
    LbvhStep<PlannedTree>{tree, state->counts.leaves, sorted.levels, sorted.met}(i);
}

}  // namespace hiprt::build::kernels
