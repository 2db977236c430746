#pragma once
/// Large ranges of references, split level by level: each kernel does one step for all ranges of a level. Internal.

#include <hiprt_build/sah_sbvh/gpu_range_steps.h>

namespace hiprt::build::kernels {

inline __device__ BlockPart part_of(const TopDownTree& tree, unsigned level, const BlockRange& range,
                                    const LargeTask& task) {
  return {tree.references[level % 2], task.begin, min(range.end, task.begin + tree.task)};
}

template <bool kSpatialSplits>
__global__ void __launch_bounds__(kTaskBlock, 8) bin_objects(TopDownTree tree, unsigned level) {
  __shared__ std::uint32_t words[ObjectBins::kSize], count_words[SlabCounts::kSize];
  __shared__ SlabPlanes planes;
  const ObjectBins bins{words};
  const SlabCounts slabs{count_words};
  const std::uint32_t tasks = tree.state->tasks[level];
  for (std::uint32_t t = blockIdx.x; t < tasks; t += gridDim.x) {
    const LargeTask task = tree.tasks[level % 2][t];
    const BlockRange& range = tree.ranges[level % 2][task.range];
    const bool counts = kSpatialSplits && range.is_crowded();
    bins.clear(threadIdx.x, kTaskBlock);
    if (counts) {
      slabs.clear(threadIdx.x, kTaskBlock);
      fill_planes(planes, range.bounds.box.get(), threadIdx.x, kTaskBlock);
    }
    const BinMapping mapping = lane_mapping(range.bounds.centers.get());
    __syncthreads();
    part_of(tree, level, range, task).for_each([&](const Reference& r) {
      bin_object(bins, mapping, r.box);
      if (counts) count_ends(slabs, planes, r.box);
    });
    __syncthreads();
    tree.object_bins(task.range).add(bins, threadIdx.x, kTaskBlock);
    if (counts) slabs.add_to(tree.slab_bins(task.range), threadIdx.x, kTaskBlock);
    __syncthreads();
  }
}

/// visit(group, number) for the ranges of a level, each by a group.
template <class Visit> __device__ void for_ranges(const TopDownTree& tree, unsigned level, Visit&& visit) {
  const std::uint32_t count = tree.state->ranges[level];
  for (std::uint32_t r = thread_index() / WaveGroup::kLanes; r < count; r += gridDim.x * kGroupsPerBlock)
    visit(WaveGroup{}, r);
}

template <bool kSpatialSplits>
__global__ void __launch_bounds__(kGroupBlock) choose_splits(TopDownTree tree, unsigned level) {
  for_ranges(tree, level, [&](const WaveGroup& group, std::uint32_t number) {
    BlockRange& range = tree.ranges[level % 2][number];
    if (tree.is_late(range)) return;
    const bool crowded = kSpatialSplits && range.is_crowded();
    const ObjectSplit split = best_object_split(group, tree.object_bins(number), range.bounds.box.get());
    group.sync();
    if (group.lane() == 0) store_object_split<kSpatialSplits>(tree, range, split);
    group.sync();
    if (!crowded || range.tries_spatial == 0) return;
    const SlabSums sums = sum_slabs(group, tree.slab_bins(number), range.size(), range.limit - range.begin);
    group.sync();
    if (group.lane() != 0) return;
    range.counted = 1;
    range.groups = sums.groups;
    range.crossing = crossing_share(sums.crossing, range.size());
    range.tries_spatial = sums.groups.has_planes() ? 1 : 0;
  });
}

static __global__ void __launch_bounds__(kTaskBlock, 4) bin_spatial(TopDownTree tree, unsigned level) {
  __shared__ BlockSlabs slabs;
  const std::uint32_t tasks = tree.state->tasks[level];
  for (std::uint32_t t = blockIdx.x; t < tasks; t += gridDim.x) {
    const LargeTask task = tree.tasks[level % 2][t];
    const BlockRange& range = tree.ranges[level % 2][task.range];
    if (range.tries_spatial == 0) continue;
    const bool counts = range.counted == 0, tries_whole = tree.tries_whole() && counts;
    slabs.begin(range, tries_whole);
    slabs.add(tree.geometries, part_of(tree, level, range, task), counts, tries_whole);
    tree.slab_bins(task.range).add(slabs.bins(), threadIdx.x, kTaskBlock);
    tree.whole_slabs(task.range, tries_whole).add(slabs.whole(tries_whole), threadIdx.x, kTaskBlock);
    __syncthreads();
  }
}

static __global__ void __launch_bounds__(kGroupBlock) choose_spatial_splits(TopDownTree tree, unsigned level) {
  for_ranges(tree, level, [&](const WaveGroup& group, std::uint32_t number) {
    BlockRange& range = tree.ranges[level % 2][number];
    if (range.tries_spatial == 0) return;
    const std::uint32_t places = range.limit - range.begin;
    const SlabBins bins = tree.slab_bins(number);
    const SpatialSplitRecord cut =
        best_spatial_split(group, bins, tree.whole_slabs(number, tree.tries_whole() && range.counted == 0),
                           tree.rules.whole_share, range.bounds.box.get(), places);
    const std::uint32_t crossing = sum_slabs(group, bins, range.size(), places).crossing;
    group.sync();
    if (group.lane() == 0) store_spatial_split(range, cut, crossing);
  });
}

static __global__ void __launch_bounds__(kTaskBlock) count_sides(TopDownTree tree, unsigned level) {
  __shared__ TaskCounts all;
  const std::uint32_t tasks = tree.state->tasks[level];
  for (std::uint32_t t = blockIdx.x; t < tasks; t += gridDim.x) {
    const LargeTask task = tree.tasks[level % 2][t];
    const BlockRange& range = tree.ranges[level % 2][task.range];
    if (range.kind == SplitKind::kMedian) continue;
    count_sides_of(range, part_of(tree, level, range, task), all);
    if (threadIdx.x == 0) tree.counts[t] = all;
    __syncthreads();
  }
}

/// Replaces the counts of a range's tasks by the sums over the tasks before. @return the sums over all tasks.
inline __device__ TaskCounts sum_counts(const WaveGroup& group, TaskCounts* counts, std::uint32_t tasks) {
  TaskCounts sum{0, 0, 0};
  for (std::uint32_t begin = 0; begin < tasks; begin += WaveGroup::kLanes) {
    const std::uint32_t i = begin + group.lane();
    const TaskCounts mine = i < tasks ? counts[i] : TaskCounts{0, 0, 0};
    const TaskCounts up_to{sum_up(group, mine.object_left), sum_up(group, mine.spatial_left),
                           sum_up(group, mine.spatial_right)};
    if (i < tasks)
      counts[i] = TaskCounts{sum.object_left + up_to.object_left - mine.object_left,
                             sum.spatial_left + up_to.spatial_left - mine.spatial_left,
                             sum.spatial_right + up_to.spatial_right - mine.spatial_right};
    sum.object_left += group.from(WaveGroup::kLanes - 1, up_to.object_left);
    sum.spatial_left += group.from(WaveGroup::kLanes - 1, up_to.spatial_left);
    sum.spatial_right += group.from(WaveGroup::kLanes - 1, up_to.spatial_right);
  }
  return sum;
}

/// A range's node, and its halves among the ranges of the next level.
static __global__ void __launch_bounds__(kGroupBlock) partition_ranges(TopDownTree tree, unsigned level) {
  for_ranges(tree, level, [&](const WaveGroup& group, std::uint32_t number) {
    BlockRange& range = tree.ranges[level % 2][number];
    TaskCounts sum{0, 0, 0};
    if (range.kind != SplitKind::kMedian)
      sum = sum_counts(group, tree.counts + range.first_task, (range.size() - 1) / tree.task + 1);
    const RangeHalves halves = RangeHalves::of(range, sum);
    const std::uint32_t left = list_range(group, tree, level + 1, halves.half(range, 0), range.crossing);
    const std::uint32_t right = list_range(group, tree, level + 1, halves.half(range, 1), range.crossing);
    group.sync();
    if (group.lane() != 0) return;
    halves.store(tree, range);
    range.child[0] = left;
    range.child[1] = right;
  });
}

static __global__ void __launch_bounds__(kTaskBlock, 3) scatter_references(TopDownTree tree, unsigned level) {
  __shared__ BlockScatter scatter;
  const std::uint32_t tasks = tree.state->tasks[level];
  for (std::uint32_t t = blockIdx.x; t < tasks; t += gridDim.x) {
    const LargeTask task = tree.tasks[level % 2][t];
    const BlockRange& range = tree.ranges[level % 2][task.range];
    const std::uint32_t offset = task.begin - range.begin;
    std::uint32_t left = min(offset, range.half - range.begin), right = offset - left;
    if (range.kind == SplitKind::kObject) left = tree.counts[t].object_left, right = offset - left;
    if (range.kind == SplitKind::kSpatial) left = tree.counts[t].spatial_left, right = tree.counts[t].spatial_right;
    const std::uint32_t before[2] = {left, right};
    const bool wanted[2] = {range.child[0] != kInvalidId, range.child[1] != kInvalidId};
    scatter.move(tree, range, part_of(tree, level, range, task), before, wanted);
    const unsigned side = threadIdx.x / RangeBox::kWords, word = threadIdx.x % RangeBox::kWords;
    if (side < 2 && wanted[side]) add_word(tree.range(level + 1, range.child[side]).bounds, scatter.sum[side], word);
    __syncthreads();
  }
}

}  // namespace hiprt::build::kernels
