#pragma once
/// Large ranges of references, split level by level: each kernel does one step for all ranges of a level. Internal.

#include <hiprt_build/sah_sbvh/gpu_top_down_blocks.h>

namespace hiprt::build::kernels {

/// visit(reference, index) for the references of a task that belong to this thread.
template <class Visit>
__device__ void for_references(const TopDownTree& tree, unsigned level, const LargeRange& range, const LargeTask& task,
                               Visit&& visit) {
  const Reference* from = tree.references[level % 2];
  const std::uint32_t end = min(range.end, task.begin + tree.task);
  for (std::uint32_t i = task.begin + threadIdx.x; i < end; i += kTaskBlock) visit(load(from + i), i);
}

/// Chooses the split of references of a range, and whether to try a spatial one. By a group.
template <bool kSpatialSplits>
__device__ void choose_split(const WaveGroup& group, const TopDownTree& tree, LargeRange& range,
                             const ObjectBins& bins) {
  const std::uint32_t places = range.limit - range.begin;
  if (is_deep(range.depth, places)) return;
  const ObjectSplit split = best_object_split(group, bins, range.bounds.box.get());
  bool cuts = kSpatialSplits && places > range.size() && split.overlap > tree.least_overlap();
  const bool counted = cuts && !range.has_one_task() && range.is_crowded();
  SlabSums sums{SlabGroups::single(), 0};
  if (counted) {
    sums = sum_slabs(group, tree.slab_bins(range), range.size(), places);
    cuts = sums.groups.has_planes();
  }
  group.sync();
  if (group.lane() != 0) return;
  range.split = split;
  range.kind = split.axis == ObjectSplit::kNoAxis ? SplitKind::kMedian : SplitKind::kObject;
  range.tries_spatial = cuts ? 1 : 0;
  range.counted = counted ? 1 : 0;
  range.groups = sums.groups;
  if (counted) range.crossing = static_cast<float>(sums.crossing) / static_cast<float>(range.size());
}

template <bool kSpatialSplits>
__global__ void __launch_bounds__(kTaskBlock, 5) bin_objects(TopDownTree tree, unsigned level) {
  __shared__ std::uint32_t words[ObjectBins::kSize], count_words[SlabCounts::kSize];
  __shared__ SlabPlanes planes;
  const ObjectBins bins{words};
  const SlabCounts slabs{count_words};
  const std::uint32_t tasks = tree.state->tasks[level];
  for (std::uint32_t t = blockIdx.x; t < tasks; t += gridDim.x) {
    const LargeTask task = tree.tasks[level % 2][t];
    LargeRange& range = tree.ranges[level % 2][task.range];
    const bool counts = kSpatialSplits && !range.has_one_task() && range.is_crowded();
    bins.clear(threadIdx.x, kTaskBlock);
    if (counts) {
      slabs.clear(threadIdx.x, kTaskBlock);
      fill_planes(planes, range.bounds.box.get(), threadIdx.x, kTaskBlock);
    }
    const BinMapping mapping = lane_mapping(range.bounds.centers.get());
    __syncthreads();
    for_references(tree, level, range, task, [&](const Reference& r, std::uint32_t) {
      bin_object(bins, mapping, r.box);
      if (counts) count_ends(slabs, planes, r.box);
    });
    __syncthreads();
    if (range.has_one_task()) {
      if (threadIdx.x < WaveGroup::kLanes) choose_split<kSpatialSplits>(WaveGroup{}, tree, range, bins);
    } else {
      tree.object_bins(range).add(bins, threadIdx.x, kTaskBlock);
      if (counts) slabs.add_to(tree.slab_bins(range), threadIdx.x, kTaskBlock);
    }
    __syncthreads();
  }
}

/// Of ranges with several tasks. A group per range.
template <bool kSpatialSplits>
__global__ void __launch_bounds__(kGroupBlock) choose_splits(TopDownTree tree, unsigned level) {
  const WaveGroup group;
  const std::uint32_t count = tree.state->ranges[level];
  for (std::uint32_t r = thread_index() / WaveGroup::kLanes; r < count; r += gridDim.x * kGroupsPerBlock) {
    LargeRange& range = tree.ranges[level % 2][r];
    if (!range.has_one_task()) choose_split<kSpatialSplits>(group, tree, range, tree.object_bins(range));
  }
}

/// Takes the best spatial split of a range if it is cheaper. By a group.
inline __device__ void choose_spatial_split(const WaveGroup& group, LargeRange& range, const SlabBins& bins) {
  const std::uint32_t places = range.limit - range.begin;
  const SpatialSplitRecord cut = best_spatial_split(group, bins, range.bounds.box.get(), places);
  const std::uint32_t crossing = sum_slabs(group, bins, range.size(), places).crossing;
  if (group.lane() != 0) return;
  range.crossing = static_cast<float>(crossing) / static_cast<float>(range.size());
  if (!(cut.cost < range.split.cost)) return;
  range.spatial = cut;
  range.kind = SplitKind::kSpatial;
}

static __global__ void __launch_bounds__(kTaskBlock, 4) bin_spatial(TopDownTree tree, unsigned level) {
  __shared__ std::uint32_t words[SlabBins::kSize];
  __shared__ SlabPlanes planes;
  __shared__ SlabGroups groups;
  __shared__ SlabQueue<kTaskBlock> queue;
  const SlabBins bins{words};
  const Reference* from = tree.references[level % 2];
  const std::uint32_t tasks = tree.state->tasks[level];
  for (std::uint32_t t = blockIdx.x; t < tasks; t += gridDim.x) {
    const LargeTask task = tree.tasks[level % 2][t];
    LargeRange& range = tree.ranges[level % 2][task.range];
    if (range.tries_spatial == 0) continue;
    const bool counts_first = range.has_one_task() && range.is_crowded();
    bins.clear(threadIdx.x, kTaskBlock);
    fill_planes(planes, range.bounds.box.get(), threadIdx.x, kTaskBlock);
    if (threadIdx.x == 0) {
      queue.clear();
      groups = range.groups;
    }
    __syncthreads();
    if (counts_first) {
      for_references(tree, level, range, task,
                     [&](const Reference& r, std::uint32_t) { count_ends(bins, planes, r.box); });
      __syncthreads();
      if (threadIdx.x < WaveGroup::kLanes) {
        const SlabSums sums = sum_slabs(WaveGroup{}, bins, range.size(), range.limit - range.begin);
        if (threadIdx.x == 0) groups = sums.groups;
      }
      __syncthreads();
    }
    const bool counts = !counts_first && range.counted == 0;
    const std::uint32_t end = groups.has_planes() ? min(range.end, task.begin + tree.task) : task.begin;
    for (std::uint32_t first = task.begin; first < end; first += kTaskBlock) {
      const std::uint32_t i = first + threadIdx.x;
      if (i < end) queue.add(bins, planes, groups, load(from + i), i - task.begin, counts);
      __syncthreads();
      // The next references may need three places each.
      const bool waits = first + kTaskBlock < end && queue.count + 3 * kTaskBlock <= queue.kSize;
      __syncthreads();
      if (waits) continue;
      queue.work(bins, planes, groups, tree.geometries, threadIdx.x,
                 [&](unsigned number) { return load(from + task.begin + number); });
      __syncthreads();
      if (threadIdx.x == 0) queue.clear();
      __syncthreads();
    }
    if (!range.has_one_task())
      tree.slab_bins(range).add(bins, threadIdx.x, kTaskBlock);
    else if (threadIdx.x < WaveGroup::kLanes)
      choose_spatial_split(WaveGroup{}, range, bins);
    __syncthreads();
  }
}

/// Of ranges with several tasks. A group per range.
static __global__ void __launch_bounds__(kGroupBlock) choose_spatial_splits(TopDownTree tree, unsigned level) {
  const WaveGroup group;
  const std::uint32_t count = tree.state->ranges[level];
  for (std::uint32_t r = thread_index() / WaveGroup::kLanes; r < count; r += gridDim.x * kGroupsPerBlock) {
    LargeRange& range = tree.ranges[level % 2][r];
    if (range.tries_spatial != 0 && !range.has_one_task()) choose_spatial_split(group, range, tree.slab_bins(range));
  }
}

/// Whether a reference goes left by the split of references.
inline __device__ bool goes_left(const ObjectSplit& split, const BinMapping& mapping, const Box& box) {
  const std::array<int, 3> bin = mapping(to_simd(box));
  const int mine = split.axis == 0 ? bin[0] : split.axis == 1 ? bin[1] : bin[2];
  return mine < static_cast<int>(split.bin);
}

/// With a spatial split the object split is counted too: it is taken if all references end up on one side of the
/// spatial split.
static __global__ void __launch_bounds__(kTaskBlock) count_sides(TopDownTree tree, unsigned level) {
  __shared__ TaskCounts all;
  const WaveGroup group;
  const std::uint32_t tasks = tree.state->tasks[level];
  for (std::uint32_t t = blockIdx.x; t < tasks; t += gridDim.x) {
    const LargeTask task = tree.tasks[level % 2][t];
    const LargeRange& range = tree.ranges[level % 2][task.range];
    if (range.kind == SplitKind::kMedian) continue;
    if (threadIdx.x == 0) all = TaskCounts{0, 0, 0};
    __syncthreads();
    const BinMapping mapping = lane_mapping(range.bounds.centers.get());
    const ObjectSplit split = range.split;
    const bool is_spatial = range.kind == SplitKind::kSpatial;
    TaskCounts mine{0, 0, 0};
    for_references(tree, level, range, task, [&](const Reference& r, std::uint32_t) {
      mine.object_left += split.axis != ObjectSplit::kNoAxis && goes_left(split, mapping, r.box) ? 1 : 0;
      if (!is_spatial) return;
      const unsigned sides = spatial_sides(range.spatial, r.box);
      mine.spatial_left += sides & kLeftSide;
      mine.spatial_right += sides >> 1;
    });
    const std::uint32_t sums[3] = {sum_up(group, mine.object_left), sum_up(group, mine.spatial_left),
                                   sum_up(group, mine.spatial_right)};
    if (group.lane() == WaveGroup::kLanes - 1) {
      fetch_add(&all.object_left, sums[0]);
      if (is_spatial) {
        fetch_add(&all.spatial_left, sums[1]);
        fetch_add(&all.spatial_right, sums[2]);
      }
    }
    __syncthreads();
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

/// A group per range: its node, and its halves among the ranges of the next level.
static __global__ void __launch_bounds__(kGroupBlock) partition_ranges(TopDownTree tree, unsigned level) {
  const WaveGroup group;
  const std::uint32_t count = tree.state->ranges[level];
  for (std::uint32_t r = thread_index() / WaveGroup::kLanes; r < count; r += gridDim.x * kGroupsPerBlock) {
    LargeRange& range = tree.ranges[level % 2][r];
    const std::uint32_t size = range.size();
    SplitKind kind = range.kind;
    std::uint32_t left_count = size / 2, right_count = size - left_count;
    float left_area = 0.0f, right_area = 0.0f;
    if (kind != SplitKind::kMedian) {
      const TaskCounts sum = sum_counts(group, tree.counts + range.first_task, (size - 1) / tree.task + 1);
      if (kind == SplitKind::kSpatial && (sum.spatial_left == 0 || sum.spatial_right == 0)) kind = SplitKind::kObject;
      if (kind == SplitKind::kObject && (sum.object_left == 0 || sum.object_left == size)) kind = SplitKind::kMedian;
      if (kind == SplitKind::kObject) {
        left_count = sum.object_left;
        right_count = size - left_count;
        left_area = range.split.left_area;
        right_area = range.split.right_area;
      }
      if (kind == SplitKind::kSpatial) {
        left_count = sum.spatial_left;
        right_count = sum.spatial_right;
        left_area = half_area(range.spatial.left);
        right_area = half_area(range.spatial.right);
      }
    }
    const Halves halves(range.begin, range.limit, left_count, right_count, left_area, right_area);
    const std::uint32_t node = halves.right_begin, depth = range.depth + 1;
    const std::uint32_t in_array = (level + 1) % 2 != 0 ? SmallRange::kOther : 0;
    const std::uint32_t left = list_range(
        group, tree, level + 1,
        SmallRange{range.begin, halves.left_end, halves.right_begin, 2 * node, depth | in_array, 0.0f}, range.crossing);
    const std::uint32_t right =
        list_range(group, tree, level + 1,
                   SmallRange{halves.right_begin, halves.right_end, range.limit, 2 * node + 1, depth | in_array, 0.0f},
                   range.crossing);
    if (group.lane() != 0) continue;
    tree.nodes[node].box = range.bounds.box.get();
    tree.set(range.link, node);
    range.kind = kind;
    range.half = range.begin + left_count;
    range.right_begin = halves.right_begin;
    range.child[0] = left;
    range.child[1] = right;
  }
}

/// Moves the references of a task to their half in the other array, in their order.
struct Scatterer {
  const TopDownTree& tree;
  const LargeRange& range;
  Reference* to;
  BinMapping mapping;
  std::uint32_t next[2];
  ThreadBounds bounds[2];

  __device__ unsigned sides(const Reference& r, std::uint32_t place) const {
    if (range.kind == SplitKind::kSpatial) return spatial_sides(range.spatial, r.box);
    const bool left = range.kind == SplitKind::kMedian ? place < range.half : goes_left(range.split, mapping, r.box);
    return left ? kLeftSide : kRightSide;
  }
  __device__ void place(const Reference& r, unsigned sides, const std::uint32_t (&rank)[2]) {
    Parts parts{r.box, r.box};
    if (sides == (kLeftSide | kRightSide))
      parts = split_reference(tree.geometries, r, range.spatial.axis, range.spatial.plane);
    if ((sides & kLeftSide) != 0) {
      to[next[0] + rank[0]] = Reference{parts.left, r.contents, r.primitive};
      bounds[0].add(parts.left);
    }
    if ((sides & kRightSide) != 0) {
      to[next[1] + rank[1]] = Reference{parts.right, r.contents, r.primitive};
      bounds[1].add(parts.right);
    }
  }
};

static __global__ void __launch_bounds__(kTaskBlock, 3) scatter_references(TopDownTree tree, unsigned level) {
  __shared__ BlockRanks ranks;
  __shared__ RangeBox sum[2];
  const Reference* from = tree.references[level % 2];
  const std::uint32_t tasks = tree.state->tasks[level];
  for (std::uint32_t t = blockIdx.x; t < tasks; t += gridDim.x) {
    const LargeTask task = tree.tasks[level % 2][t];
    const LargeRange& range = tree.ranges[level % 2][task.range];
    if (threadIdx.x < 2) clear(sum[threadIdx.x]);
    const std::uint32_t offset = task.begin - range.begin, end = min(range.end, task.begin + tree.task);
    std::uint32_t left = min(offset, range.half - range.begin), right = offset - left;
    if (range.kind == SplitKind::kObject) left = tree.counts[t].object_left, right = offset - left;
    if (range.kind == SplitKind::kSpatial) left = tree.counts[t].spatial_left, right = tree.counts[t].spatial_right;
    Scatterer scatterer{tree,
                        range,
                        tree.references[(level + 1) % 2],
                        lane_mapping(range.bounds.centers.get()),
                        {range.begin + left, range.right_begin + right},
                        {}};
    for (std::uint32_t first = task.begin; first < end; first += kTaskBlock) {
      const std::uint32_t i = first + threadIdx.x;
      Reference reference{};
      if (i < end) reference = load(from + i);
      const unsigned sides = i < end ? scatterer.sides(reference, i) : 0;
      std::uint32_t rank[2], total[2];
      ranks.rank(sides, rank, total);
      if (sides != 0) scatterer.place(reference, sides, rank);
      for (unsigned side = 0; side < 2; ++side) scatterer.next[side] += total[side];
    }
    __syncthreads();
    for (unsigned side = 0; side < 2; ++side)
      if (range.child[side] != kInvalidId) scatterer.bounds[side].give(WaveGroup{}, sum[side]);
    __syncthreads();
    const unsigned side = threadIdx.x / RangeBox::kWords, word = threadIdx.x % RangeBox::kWords;
    if (side < 2 && range.child[side] != kInvalidId)
      add_word(tree.ranges[(level + 1) % 2][range.child[side]].bounds, sum[side], word);
    __syncthreads();
  }
}

}  // namespace hiprt::build::kernels
