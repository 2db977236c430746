#pragma once
/// Large ranges of references, split level by level: each kernel does one step for all ranges of a level. Internal.

#include <hiprt_build/src/gpu_top_down_state.h>

namespace hiprt::build::kernels {

inline constexpr unsigned kTaskBlock = 256, kTaskGroups = kTaskBlock / WaveGroup::kLanes;

/// Ranks of the references of a block that go to a side, in their order.
struct BlockRanks {
  std::uint32_t in_group[2][kTaskGroups];

  /// @param sides of this thread's reference, 0 where it has none. @param rank those before it, left and right.
  /// @param total of the block. To be called by all threads.
  __device__ void rank(unsigned sides, std::uint32_t (&rank)[2], std::uint32_t (&total)[2]) {
    const WaveGroup group;
    const unsigned my_group = threadIdx.x / WaveGroup::kLanes;
    for (unsigned side = 0; side < 2; ++side) {
      const std::uint32_t lanes = group.ballot((sides >> side & 1u) != 0);
      rank[side] = lane_count(lanes & ((1u << group.lane()) - 1));
      if (group.lane() == 0) in_group[side][my_group] = lane_count(lanes);
    }
    __syncthreads();
    for (unsigned side = 0; side < 2; ++side) {
      total[side] = 0;
      for (unsigned g = 0; g < kTaskGroups; ++g) {
        rank[side] += g < my_group ? in_group[side][g] : 0;
        total[side] += in_group[side][g];
      }
    }
    __syncthreads();
  }
};

/// Bounds of the references that a thread has seen.
struct ThreadBounds {
  Box box = empty_box(), centers = empty_box();

  __device__ void add(const Box& other) {
    grow_fast(box, other);
    Box center;
    for (unsigned k = 0; k < 3; ++k) center.min[k] = center.max[k] = split_position(other, k);
    grow_fast(centers, center);
  }
  /// Adds the group's to those of the block.
  __device__ void give(const WaveGroup& group, RangeBox& to) const {
    const Box all = unite_lanes(group, box), all_centers = unite_lanes(group, centers);
    if (group.lane() != 0 || holds_nothing(all)) return;
    to.box.add(all);
    to.centers.add(all_centers);
  }
};
/// Adds a block's bounds, a word per thread. @param word below RangeBox::kWords.
inline __device__ void add_word(RangeBox& to, RangeBox& from, unsigned word) {
  std::uint32_t* target = to.words() + word;
  const std::uint32_t value = from.words()[word], there = load_shared(target);
  if (RangeBox::is_low(word)) {
    if (value < there) hiprt::lower(target, value);
  } else if (value > there) {
    raise(target, value);
  }
}
inline __device__ void clear(RangeBox& bounds) {
  bounds.box.clear();
  bounds.centers.clear();
}

// The input, without its holes ----------------------------------------------------------------------------------------

static __global__ void __launch_bounds__(kTaskBlock)
    count_references(const LeafReference* input, std::uint32_t size, std::uint32_t piece, std::uint32_t* counts) {
  __shared__ std::uint32_t count;
  if (threadIdx.x == 0) count = 0;
  __syncthreads();
  const std::uint32_t begin = blockIdx.x * piece, end = min(size, begin + piece);
  std::uint32_t mine = 0;
  for (std::uint32_t i = begin + threadIdx.x; i < end; i += kTaskBlock) mine += input[i].group.exists() ? 1 : 0;
  const WaveGroup group;
  mine = sum_up(group, mine);
  if (group.lane() == WaveGroup::kLanes - 1) fetch_add(&count, mine);
  __syncthreads();
  if (threadIdx.x == 0) counts[blockIdx.x] = count;
}

/// Lists a range of which all but the bounds is known: its tasks, or itself if it is small. @return its number in the
/// list, or kInvalidId. To be called by all lanes.
inline __device__ std::uint32_t list_range(const WaveGroup& group, const TopDownTree& tree, unsigned level,
                                           const SmallRange& range) {
  TopDownState& state = *tree.state;
  std::uint32_t number = kInvalidId, first_task = 0;
  if (range.size() <= tree.few) {
    if (group.lane() == 0) tree.small_ranges[fetch_add(&state.small_ranges, 1)] = range;
    return kInvalidId;
  }
  const std::uint32_t tasks = (range.size() - 1) / tree.task + 1;
  if (group.lane() == 0) {
    number = fetch_add(&state.ranges[level], 1);
    first_task = fetch_add(&state.tasks[level], tasks);
    LargeRange& large = tree.ranges[level % 2][number];
    clear(large.bounds);
    large.begin = range.begin;
    large.end = range.end;
    large.limit = range.limit;
    large.depth = range.depth();
    large.link = range.link;
    large.first_task = first_task;
    large.way = Way::kHalves;
    large.tries_cut = 0;
  }
  number = group.from(0, number);
  first_task = group.from(0, first_task);
  for (std::uint32_t i = group.lane(); i < tasks; i += WaveGroup::kLanes)
    tree.tasks[level % 2][first_task + i] = LargeTask{number, range.begin + i * tree.task};
  tree.object_bins(number).clear(group.lane(), WaveGroup::kLanes);
  return number;
}

/// One group. Counts become sums of those before.
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
  std::uint32_t limit = wanted < static_cast<double>(tree.room) ? static_cast<std::uint32_t>(wanted) : tree.room;
  limit = limit < sum ? sum : limit;
  if (group.lane() == 0) {
    clear(state.bounds);
    state.count = sum;
    state.limit = limit;
    *tree.root = kInvalidId;
    *tree.leaves = 0;
  }
  if (sum != 0) list_range(group, tree, 0, SmallRange{0, sum, limit, kInvalidId, 0, 0.0f});
}

static __global__ void __launch_bounds__(kTaskBlock)
    pack_references(TopDownTree tree, const LeafReference* input, std::uint32_t size, std::uint32_t piece,
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
    LeafReference reference{};
    reference.group = PackedGroup::none();
    if (i < end) reference = input[i];
    const bool exists = reference.group.exists();
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
  }
  for (std::uint32_t i = tree.state->limit + thread_index(); i < tree.room; i += gridDim.x * kTaskBlock)
    tree.references[1][i] = no_reference();
}

// A level -------------------------------------------------------------------------------------------------------------

/// The references of a task that this thread looks at: visit(reference, place).
template <class Visit>
__device__ void for_references(const TopDownTree& tree, unsigned level, const LargeRange& range, const LargeTask& task,
                               Visit&& visit) {
  const LeafReference* from = tree.references[level % 2];
  const std::uint32_t end = min(range.end, task.begin + tree.task);
  for (std::uint32_t i = task.begin + threadIdx.x; i < end; i += kTaskBlock) visit(from[i], i);
}

static __global__ void __launch_bounds__(kTaskBlock) bin_objects(TopDownTree tree, unsigned level) {
  __shared__ std::uint32_t words[ObjectBins::kSize];
  const ObjectBins bins{words};
  const std::uint32_t tasks = tree.state->tasks[level];
  for (std::uint32_t t = blockIdx.x; t < tasks; t += gridDim.x) {
    const LargeTask task = tree.tasks[level % 2][t];
    const LargeRange& range = tree.ranges[level % 2][task.range];
    bins.clear(threadIdx.x, kTaskBlock);
    const BinMapping mapping = lane_mapping(range.bounds.centers.get());
    __syncthreads();
    for_references(tree, level, range, task,
                   [&](const LeafReference& r, std::uint32_t) { bin_object(bins, mapping, r.box); });
    __syncthreads();
    tree.object_bins(task.range).add(bins, threadIdx.x, kTaskBlock);
    __syncthreads();
  }
}

/// A group per range.
template <bool kCuts>
__global__ void __launch_bounds__(kGroupBlock) choose_splits(TopDownTree tree, unsigned level) {
  const WaveGroup group;
  const std::uint32_t count = tree.state->ranges[level];
  const float least = tree.least_overlap();
  for (std::uint32_t r = thread_index() / WaveGroup::kLanes; r < count; r += gridDim.x * kGroupsPerBlock) {
    LargeRange& range = tree.ranges[level % 2][r];
    const std::uint32_t places = range.limit - range.begin;
    if (is_deep(range.depth, places)) continue;
    const ObjectSplit split = best_object_split(group, tree.object_bins(r), range.bounds.box.get());
    const bool cuts = kCuts && places > range.size() && split.overlap > least;
    if (cuts) {
      group.sync();
      tree.slab_bins(r).clear(group.lane(), WaveGroup::kLanes);
    }
    if (group.lane() != 0) continue;
    range.split = split;
    range.way = split.axis == ObjectSplit::kNoAxis ? Way::kHalves : Way::kObjects;
    range.tries_cut = cuts ? 1 : 0;
  }
}

static __global__ void __launch_bounds__(kTaskBlock) bin_space(TopDownTree tree, unsigned level) {
  __shared__ std::uint32_t words[SlabBins::kSize];
  __shared__ SlabPlanes planes;
  const SlabBins bins{words};
  const std::uint32_t tasks = tree.state->tasks[level];
  for (std::uint32_t t = blockIdx.x; t < tasks; t += gridDim.x) {
    const LargeTask task = tree.tasks[level % 2][t];
    const LargeRange& range = tree.ranges[level % 2][task.range];
    if (range.tries_cut == 0) continue;
    bins.clear(threadIdx.x, kTaskBlock);
    fill_planes(planes, range.bounds.box.get(), threadIdx.x, kTaskBlock);
    __syncthreads();
    for_references(tree, level, range, task,
                   [&](const LeafReference& r, std::uint32_t) { bin_slabs(bins, planes, tree.soup, r); });
    __syncthreads();
    tree.slab_bins(task.range).add(bins, threadIdx.x, kTaskBlock);
    __syncthreads();
  }
}

/// A group per range.
static __global__ void __launch_bounds__(kGroupBlock) choose_cuts(TopDownTree tree, unsigned level) {
  const WaveGroup group;
  const std::uint32_t count = tree.state->ranges[level];
  for (std::uint32_t r = thread_index() / WaveGroup::kLanes; r < count; r += gridDim.x * kGroupsPerBlock) {
    LargeRange& range = tree.ranges[level % 2][r];
    if (range.tries_cut == 0) continue;
    const Cut cut = best_cut(group, tree.slab_bins(r), range.bounds.box.get(), range.limit - range.begin);
    if (group.lane() != 0 || !(cut.cost < range.split.cost)) continue;
    range.cut = cut;
    range.way = Way::kCut;
  }
}

/// Whether a reference goes left by the split of references.
inline __device__ bool goes_left(const ObjectSplit& split, const BinMapping& mapping, const Box& box) {
  const std::array<int, 3> bin = mapping(to_aabb(box));
  const int mine = split.axis == 0 ? bin[0] : split.axis == 1 ? bin[1] : bin[2];
  return mine < static_cast<int>(split.bin);
}

/// Where a cut is chosen the split of references is counted too: it is taken if all end up on one side of the cut.
static __global__ void __launch_bounds__(kTaskBlock) count_sides(TopDownTree tree, unsigned level) {
  __shared__ TaskCounts all;
  const WaveGroup group;
  const std::uint32_t tasks = tree.state->tasks[level];
  for (std::uint32_t t = blockIdx.x; t < tasks; t += gridDim.x) {
    const LargeTask task = tree.tasks[level % 2][t];
    const LargeRange& range = tree.ranges[level % 2][task.range];
    if (range.way == Way::kHalves) continue;
    if (threadIdx.x == 0) all = TaskCounts{0, 0, 0};
    __syncthreads();
    const BinMapping mapping = lane_mapping(range.bounds.centers.get());
    const ObjectSplit split = range.split;
    const bool is_cut = range.way == Way::kCut;
    TaskCounts mine{0, 0, 0};
    for_references(tree, level, range, task, [&](const LeafReference& r, std::uint32_t) {
      mine.objects_left += split.axis != ObjectSplit::kNoAxis && goes_left(split, mapping, r.box) ? 1 : 0;
      if (!is_cut) return;
      const unsigned sides = cut_sides(range.cut, r.box);
      mine.cut_left += sides & kLeftSide;
      mine.cut_right += sides >> 1;
    });
    const std::uint32_t sums[3] = {sum_up(group, mine.objects_left), sum_up(group, mine.cut_left),
                                   sum_up(group, mine.cut_right)};
    if (group.lane() == WaveGroup::kLanes - 1) {
      fetch_add(&all.objects_left, sums[0]);
      if (is_cut) {
        fetch_add(&all.cut_left, sums[1]);
        fetch_add(&all.cut_right, sums[2]);
      }
    }
    __syncthreads();
    if (threadIdx.x == 0) tree.counts[t] = all;
    __syncthreads();
  }
}

/// Counts of a range's tasks become sums of those before. @return those of all.
inline __device__ TaskCounts sum_counts(const WaveGroup& group, TaskCounts* counts, std::uint32_t tasks) {
  TaskCounts sum{0, 0, 0};
  for (std::uint32_t begin = 0; begin < tasks; begin += WaveGroup::kLanes) {
    const std::uint32_t i = begin + group.lane();
    const TaskCounts mine = i < tasks ? counts[i] : TaskCounts{0, 0, 0};
    const TaskCounts up_to{sum_up(group, mine.objects_left), sum_up(group, mine.cut_left),
                           sum_up(group, mine.cut_right)};
    if (i < tasks)
      counts[i] = TaskCounts{sum.objects_left + up_to.objects_left - mine.objects_left,
                             sum.cut_left + up_to.cut_left - mine.cut_left,
                             sum.cut_right + up_to.cut_right - mine.cut_right};
    sum.objects_left += group.from(WaveGroup::kLanes - 1, up_to.objects_left);
    sum.cut_left += group.from(WaveGroup::kLanes - 1, up_to.cut_left);
    sum.cut_right += group.from(WaveGroup::kLanes - 1, up_to.cut_right);
  }
  return sum;
}

/// A group per range: its node, and its halves among the ranges of the next level.
static __global__ void __launch_bounds__(kGroupBlock) part_ranges(TopDownTree tree, unsigned level) {
  const WaveGroup group;
  const std::uint32_t count = tree.state->ranges[level];
  for (std::uint32_t r = thread_index() / WaveGroup::kLanes; r < count; r += gridDim.x * kGroupsPerBlock) {
    LargeRange& range = tree.ranges[level % 2][r];
    const std::uint32_t size = range.size();
    Way way = range.way;
    std::uint32_t left_count = size / 2, right_count = size - left_count;
    if (way != Way::kHalves) {
      const TaskCounts sum =
          sum_counts(group, tree.counts + range.first_task, (size - 1) / tree.task + 1);
      if (way == Way::kCut && (sum.cut_left == 0 || sum.cut_right == 0)) way = Way::kObjects;
      if (way == Way::kObjects && (sum.objects_left == 0 || sum.objects_left == size)) way = Way::kHalves;
      if (way == Way::kObjects) left_count = sum.objects_left, right_count = size - left_count;
      if (way == Way::kCut) left_count = sum.cut_left, right_count = sum.cut_right;
    }
    const Halves halves(range.begin, range.limit, left_count, right_count);
    const std::uint32_t node = halves.right_begin, depth = range.depth + 1;
    const std::uint32_t in_array = (level + 1) % 2 != 0 ? SmallRange::kOther : 0;
    const std::uint32_t left = list_range(
        group, tree, level + 1,
        SmallRange{range.begin, halves.left_end, halves.right_begin, 2 * node, depth | in_array, 0.0f});
    const std::uint32_t right = list_range(
        group, tree, level + 1,
        SmallRange{halves.right_begin, halves.right_end, range.limit, 2 * node + 1, depth | in_array, 0.0f});
    if (group.lane() != 0) continue;
    tree.nodes[node].box = range.bounds.box.get();
    tree.set(range.link, node);
    range.way = way;
    range.half = range.begin + left_count;
    range.right_begin = halves.right_begin;
    range.child[0] = left;
    range.child[1] = right;
  }
}

/// What moves a task's references to their half's place in the other array, in their order.
struct Scatterer {
  const TopDownTree& tree;
  const LargeRange& range;
  LeafReference* to;
  BinMapping mapping;
  std::uint32_t next[2];
  ThreadBounds bounds[2];

  __device__ unsigned sides(const LeafReference& r, std::uint32_t place) const {
    if (range.way == Way::kCut) return cut_sides(range.cut, r.box);
    const bool left = range.way == Way::kHalves ? place < range.half : goes_left(range.split, mapping, r.box);
    return left ? kLeftSide : kRightSide;
  }
  __device__ void place(const LeafReference& r, unsigned sides, const std::uint32_t (&rank)[2]) {
    Parts parts{r.box, r.box};
    if (sides == (kLeftSide | kRightSide)) parts = cut_reference(tree.soup, r, range.cut.axis, range.cut.plane);
    if ((sides & kLeftSide) != 0) {
      to[next[0] + rank[0]] = LeafReference{parts.left, r.group, r.primitive};
      bounds[0].add(parts.left);
    }
    if ((sides & kRightSide) != 0) {
      to[next[1] + rank[1]] = LeafReference{parts.right, r.group, r.primitive};
      bounds[1].add(parts.right);
    }
  }
};

static __global__ void __launch_bounds__(kTaskBlock) scatter_references(TopDownTree tree, unsigned level) {
  __shared__ BlockRanks ranks;
  __shared__ RangeBox sum[2];
  const LeafReference* from = tree.references[level % 2];
  const std::uint32_t tasks = tree.state->tasks[level];
  for (std::uint32_t t = blockIdx.x; t < tasks; t += gridDim.x) {
    const LargeTask task = tree.tasks[level % 2][t];
    const LargeRange& range = tree.ranges[level % 2][task.range];
    if (threadIdx.x < 2) clear(sum[threadIdx.x]);
    const std::uint32_t offset = task.begin - range.begin, end = min(range.end, task.begin + tree.task);
    std::uint32_t left = min(offset, range.half - range.begin), right = offset - left;
    if (range.way == Way::kObjects) left = tree.counts[t].objects_left, right = offset - left;
    if (range.way == Way::kCut) left = tree.counts[t].cut_left, right = tree.counts[t].cut_right;
    Scatterer scatterer{tree,
                        range,
                        tree.references[(level + 1) % 2],
                        lane_mapping(range.bounds.centers.get()),
                        {range.begin + left, range.right_begin + right},
                        {}};
    for (std::uint32_t first = task.begin; first < end; first += kTaskBlock) {
      const std::uint32_t i = first + threadIdx.x;
      LeafReference reference{};
      if (i < end) reference = from[i];
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
