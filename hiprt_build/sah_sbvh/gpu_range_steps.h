#pragma once
/// The steps of a block that splits a range, or a task of one. Internal.
///
/// References are binned; a split is chosen; the references of its sides are counted and moved to the other array.

#include <hiprt_build/sah_sbvh/gpu_top_down_blocks.h>

namespace hiprt::build::kernels {

/// References of a range that a block processes together.
struct BlockPart {
  const Reference* from;  ///< The array.
  std::uint32_t begin, end;

  /// Calls visit(reference) for the references of this thread.
  template <class Visit> __device__ void for_each(Visit&& visit) const {
    for (std::uint32_t i = begin + threadIdx.x; i < end; i += kTaskBlock) visit(load(from + i));
  }
};

/// Stores the object split of a range, and whether to try a spatial split. By one thread.
template <bool kSpatialSplits>
__device__ void store_object_split(const TopDownTree& tree, BlockRange& range, const ObjectSplit& split) {
  const bool has_room = range.size() >= kLeastCutRange && range.limit - range.begin > range.size();
  range.split = split;
  range.kind = split.axis == ObjectSplit::kNoAxis ? SplitKind::kMedian : SplitKind::kObject;
  range.groups = SlabGroups::single();
  range.counted = 0;
  range.tries_spatial = kSpatialSplits && has_room &&
                        halves_overlap(split.overlap, tree.least_overlap(), half_area(range.bounds.box.get()));
}

/// Stores the best spatial split of a range, if it is cheaper than the object split. By one thread.
/// @param crossing the most references that a plane cuts.
inline __device__ void store_spatial_split(BlockRange& range, const SpatialSplitRecord& cut, std::uint32_t crossing) {
  range.crossing = crossing_share(crossing, range.size());
  if (!(cut.cost < range.split.cost)) return;
  range.spatial = cut;
  range.kind = SplitKind::kSpatial;
}

/// A block's bins of the parts of references. All threads call each function.
struct BlockSlabs {
  std::uint32_t words[SlabBins::kSize], whole_words[WholeSlabs::kSize];
  SlabPlanes planes;
  SlabGroups groups;
  SlabQueue<kTaskBlock> queue;

  __device__ SlabBins bins() { return SlabBins{words}; }
  /// @param used whether splits that cut nothing are tried.
  __device__ WholeSlabs whole(bool used) { return WholeSlabs{whole_words, used}; }
  __device__ void begin(const BlockRange& range, bool tries_whole) {
    bins().clear(threadIdx.x, kTaskBlock);
    whole(tries_whole).clear(threadIdx.x, kTaskBlock);
    fill_planes(planes, range.bounds.box.get(), threadIdx.x, kTaskBlock);
    if (threadIdx.x == 0) {
      queue.clear();
      groups = range.groups;
    }
    __syncthreads();
  }
  /// @param counts whether references are counted, too.
  __device__ void add(const GeometryTable& geometries, const BlockPart& part, bool counts, bool tries_whole) {
    for (std::uint32_t first = part.begin; first < part.end; first += kTaskBlock) {
      const std::uint32_t i = first + threadIdx.x;
      if (i < part.end)
        queue.add(bins(), whole(tries_whole), planes, groups, load(part.from + i), i - part.begin, counts);
      __syncthreads();
      const bool waits = first + kTaskBlock < part.end && queue.count + queue.kMost * kTaskBlock <= queue.kSize;
      __syncthreads();
      if (waits) continue;
      queue.work(bins(), planes, groups, geometries, threadIdx.x,
                 [&](unsigned number) { return load(part.from + part.begin + number); });
      __syncthreads();
      if (threadIdx.x == 0) queue.clear();
      __syncthreads();
    }
  }
};

/// Whether a reference goes left by the split of references.
inline __device__ bool goes_left(const ObjectSplit& split, const BinMapping& mapping, const Box& box) {
  const std::array<int, 3> bin = mapping(to_simd(box));
  const int mine = split.axis == 0 ? bin[0] : split.axis == 1 ? bin[1] : bin[2];
  return mine < static_cast<int>(split.bin);
}

/// Counts the references of a part on each side. With a spatial split the object split is counted too: it is taken if
/// all references end up on one side of the spatial split. By a block. @pre the range has a split.
inline __device__ void count_sides_of(const BlockRange& range, const BlockPart& part, TaskCounts& all) {
  const WaveGroup group;
  if (threadIdx.x == 0) all = TaskCounts{0, 0, 0};
  __syncthreads();
  const BinMapping mapping = lane_mapping(range.bounds.centers.get());
  const ObjectSplit split = range.split;
  const bool is_spatial = range.kind == SplitKind::kSpatial;
  TaskCounts mine{0, 0, 0};
  part.for_each([&](const Reference& r) {
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
}

/// What becomes of a range: its kind of split, if that puts references on both sides, and its halves.
struct RangeHalves {
  SplitKind kind;
  std::uint32_t left_count;
  Halves halves;

  /// @param sum over all references; not read for SplitKind::kMedian.
  __device__ static RangeHalves of(const BlockRange& range, const TaskCounts& sum) {
    const std::uint32_t size = range.size();
    SplitKind kind = range.kind;
    if (kind == SplitKind::kSpatial && (sum.spatial_left == 0 || sum.spatial_right == 0)) kind = SplitKind::kObject;
    if (kind == SplitKind::kObject && (sum.object_left == 0 || sum.object_left == size)) kind = SplitKind::kMedian;
    std::uint32_t left = size / 2, right = size - left;
    float left_area = 0.0f, right_area = 0.0f;
    if (kind == SplitKind::kObject) {
      left = sum.object_left;
      right = size - left;
      left_area = range.split.left_area;
      right_area = range.split.right_area;
    }
    if (kind == SplitKind::kSpatial) {
      left = sum.spatial_left;
      right = sum.spatial_right;
      left_area = half_area(range.spatial.left);
      right_area = half_area(range.spatial.right);
    }
    return {kind, left, Halves(range.begin, range.limit, left, right, left_area, right_area)};
  }
  __device__ std::uint32_t node() const { return halves.right_begin; }
  /// @param side 0: left.
  __device__ SmallRange half(const BlockRange& range, unsigned side) const {
    const std::uint32_t depth = range.depth + 1;
    const std::uint32_t state = SmallRange::pack(depth, depth % 2 != 0 ? SmallRange::kOther : 0, range.crossing);
    if (side == 0) return {range.begin, halves.left_end, halves.right_begin, 2 * node(), state, 0.0f};
    return {halves.right_begin, halves.right_end, range.limit, 2 * node() + 1, state, 0.0f};
  }
  /// By one thread.
  __device__ void store(const TopDownTree& tree, BlockRange& range) const {
    tree.nodes[node()].box = range.bounds.box.get();
    tree.set(range.link, node());
    range.kind = kind;
    range.half = range.begin + left_count;
    range.right_begin = halves.right_begin;
  }
};

/// What one thread of BlockScatter does.
struct Scatterer {
  const TopDownTree& tree;
  const BlockRange& range;
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

/// Moves the references of a part to their halves, in their order. All threads call it.
struct BlockScatter {
  BlockRanks ranks;
  RangeBox sum[2];  ///< Receives the bounds of what went to each side, if they are wanted.

  /// @param before references of the range on each side, in the parts before.
  __device__ void move(const TopDownTree& tree, const BlockRange& range, const BlockPart& part,
                       const std::uint32_t (&before)[2], const bool (&wanted)[2]) {
    if (threadIdx.x < 2) clear(sum[threadIdx.x]);
    Scatterer scatterer{tree,
                        range,
                        tree.references[(range.depth + 1) % 2],
                        lane_mapping(range.bounds.centers.get()),
                        {range.begin + before[0], range.right_begin + before[1]},
                        {}};
    for (std::uint32_t first = part.begin; first < part.end; first += kTaskBlock) {
      const std::uint32_t i = first + threadIdx.x;
      Reference reference{};
      if (i < part.end) reference = load(part.from + i);
      const unsigned sides = i < part.end ? scatterer.sides(reference, i) : 0;
      std::uint32_t rank[2], total[2];
      ranks.rank(sides, rank, total);
      if (sides != 0) scatterer.place(reference, sides, rank);
      for (unsigned side = 0; side < 2; ++side) scatterer.next[side] += total[side];
    }
    __syncthreads();
    for (unsigned side = 0; side < 2; ++side)
      if (wanted[side]) scatterer.bounds[side].give(WaveGroup{}, sum[side]);
    __syncthreads();
  }
};

}  // namespace hiprt::build::kernels
