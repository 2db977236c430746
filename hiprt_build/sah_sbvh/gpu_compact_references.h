#pragma once
/// Compacts the references of the input into the first range. Internal.

#include <hiprt_build/sah_sbvh/gpu_top_down_blocks.h>

namespace hiprt::build::kernels {

static __global__ void __launch_bounds__(kTaskBlock)
    count_references(const Reference* input, std::uint32_t size, std::uint32_t piece, std::uint32_t* counts) {
  __shared__ std::uint32_t count;
  if (threadIdx.x == 0) count = 0;
  __syncthreads();
  const std::uint32_t begin = blockIdx.x * piece, end = min(size, begin + piece);
  std::uint32_t mine = 0;
  for (std::uint32_t i = begin + threadIdx.x; i < end; i += kTaskBlock) mine += input[i].contents.exists() ? 1 : 0;
  const WaveGroup group;
  mine = sum_up(group, mine);
  if (group.lane() == WaveGroup::kLanes - 1) fetch_add(&count, mine);
  __syncthreads();
  if (threadIdx.x == 0) counts[blockIdx.x] = count;
}

/// One group. Replaces counts by the sums of the counts before.
static __global__ void begin_ranges(TopDownTree tree, std::uint32_t* counts, std::uint32_t pieces, double budget) {
  const WaveGroup group;
  TopDownState& state = *tree.state;
  std::uint32_t sum = 0;
  for (std::uint32_t begin = 0; begin < pieces; begin += WaveGroup::kLanes) {
    const std::uint32_t i = begin + group.lane(), value = i < pieces ? counts[i] : 0;
    const std::uint32_t up_to = sum_up(group, value);
    if (i < pieces) counts[i] = sum + up_to - value;
    sum += group.from(WaveGroup::kLanes - 1, up_to);
  }
  const double wanted = static_cast<double>(sum) * budget;
  std::uint32_t limit =
      wanted < static_cast<double>(tree.capacity) ? static_cast<std::uint32_t>(wanted) : tree.capacity;
  limit = limit < sum ? sum : limit;
  if (group.lane() == 0) {
    clear(state.bounds);
    state.count = sum;
    state.limit = limit;
    *tree.root = kInvalidId;
    *tree.leaves = 0;
  }
  if (sum != 0)
    list_range(group, tree, 0, SmallRange{0, sum, limit, kInvalidId, SmallRange::pack(0, 0, 1.0f), 0.0f}, 1.0f);
}

static __global__ void __launch_bounds__(kTaskBlock)
    compact_references(TopDownTree tree, const Reference* input, std::uint32_t size, std::uint32_t piece,
                       const std::uint32_t* before) {
  __shared__ BlockRanks ranks;
  __shared__ RangeBox sum;
  if (threadIdx.x == 0) clear(sum);
  __syncthreads();
  ThreadBounds bounds;
  const std::uint32_t begin = blockIdx.x * piece, end = min(size, begin + piece);
  std::uint32_t to = before[blockIdx.x];
  for (std::uint32_t first = begin; first < end; first += kTaskBlock) {
    const std::uint32_t i = first + threadIdx.x;
    Reference reference{};
    reference.contents = LeafContents::none();
    if (i < end) reference = load(input + i);
    const bool exists = reference.contents.exists();
    std::uint32_t rank[2], total[2];
    ranks.rank(exists ? kLeftSide : 0, rank, total);
    if (exists) {
      tree.references[0][to + rank[0]] = reference;
      bounds.add(reference.box);
    }
    to += total[0];
  }
  bounds.give(WaveGroup{}, sum);
  __syncthreads();
  if (threadIdx.x < RangeBox::kWords) {
    add_word(tree.state->bounds, sum, threadIdx.x);
    if (tree.state->ranges[0] != 0) add_word(tree.ranges[0][0].bounds, sum, threadIdx.x);
    if (tree.state->medium_ranges != 0) add_word(tree.medium_ranges[0].bounds, sum, threadIdx.x);
  }
  for (std::uint32_t i = tree.state->limit + thread_index(); i < tree.capacity; i += gridDim.x * kTaskBlock)
    tree.references[1][i] = no_reference();
}

}  // namespace hiprt::build::kernels
