#pragma once
/// Medium ranges of references: a block splits one, and its halves, until they are small. Internal.

#include <hiprt_build/sah_sbvh/gpu_range_steps.h>

namespace hiprt::build::kernels {

/// A medium range before its split.
struct PendingRange {
  RangeBox bounds;
  std::uint32_t begin, end, limit, depth, link;
  float crossing;
};

/// Shared memory of a block.
struct MediumShared {
  /// The half with fewer places is split first, so that each pending range has twice the places of the next one.
  static constexpr unsigned kMostPending = 32;

  BlockRange range;
  union {
    std::uint32_t object_words[ObjectBins::kSize];
    BlockSlabs slabs;
    BlockScatter scatter;
  };
  ObjectSplit objects[3];  ///< By axis.
  SpatialSplitRecord cuts[3];
  std::uint32_t crossing[3];
  TaskCounts counts;
  std::uint32_t ticket, pending_count;
  PendingRange pending[kMostPending];
};

/// All threads of a block call each function.
/// @tparam kSpatialSplits whether spatial splits are allowed.
template <bool kSpatialSplits> class MediumBuilder {
 public:
  __device__ MediumBuilder(const TopDownTree& tree, MediumShared& shared) : tree_(tree), shared_(shared) {}

  /// @pre a barrier since the last use of shared memory.
  __device__ void build(const BlockRange& range) {
    copy_words(shared_.range, range);
    if (threadIdx.x == 0) shared_.pending_count = 0;
    __syncthreads();
    do {
      choose();
      split();
    } while (take());
  }

 private:
  template <class T> __device__ static void copy_words(T& to, const T& from) {
    static_assert(sizeof(T) % 4 == 0);
    for (unsigned i = threadIdx.x; i < sizeof(T) / 4; i += kTaskBlock)
      reinterpret_cast<std::uint32_t*>(&to)[i] = reinterpret_cast<const std::uint32_t*>(&from)[i];
  }
  __device__ BlockPart part() const {
    const BlockRange& range = shared_.range;
    return {tree_.references[range.depth % 2], range.begin, range.end};
  }

  /// An axis for each of the first three groups: visit(group, axis, whether the lane is the first).
  template <class Visit> __device__ static void for_axes(Visit&& visit) {
    const unsigned axis = threadIdx.x / WaveGroup::kLanes;
    const WaveGroup group;
    if (axis < 3) visit(group, axis, group.lane() == 0);
  }

  __device__ void choose() const {
    BlockRange& range = shared_.range;
    if (tree_.is_late(range)) return;
    const ObjectBins bins{shared_.object_words};
    bins.clear(threadIdx.x, kTaskBlock);
    const BinMapping mapping = lane_mapping(range.bounds.centers.get());
    __syncthreads();
    part().for_each([&](const Reference& r) { bin_object(bins, mapping, r.box); });
    __syncthreads();
    for_axes([&](const WaveGroup& group, unsigned axis, bool writes) {
      const ObjectSplit split = best_object_split(group, bins, range.bounds.box.get(), axis, axis + 1);
      if (writes) shared_.objects[axis] = split;
    });
    __syncthreads();
    if (threadIdx.x == 0)
      store_object_split<kSpatialSplits>(
          tree_, range, cheapest(shared_.objects, [](const ObjectSplit& split) { return split.cost; }));
    __syncthreads();
    if constexpr (kSpatialSplits)
      if (range.tries_spatial != 0) choose_spatial();
  }

  __device__ void choose_spatial() const {
    BlockRange& range = shared_.range;
    BlockSlabs& slabs = shared_.slabs;
    const std::uint32_t places = range.limit - range.begin;
    const bool counts_first = range.is_crowded(), tries_whole = tree_.tries_whole() && !counts_first;
    slabs.begin(range, tries_whole);
    if (counts_first) {
      part().for_each([&](const Reference& r) { count_ends(slabs.bins(), slabs.planes, r.box); });
      __syncthreads();
      for_axes([&](const WaveGroup& group, unsigned axis, bool writes) {
        const AxisSums sums(group, slabs.bins(), axis, range.size(), places);
        if (writes) slabs.groups.begins[axis] = sums.begins;
      });
      __syncthreads();
    }
    if (slabs.groups.has_planes()) slabs.add(tree_.geometries, part(), !counts_first, tries_whole);
    for_axes([&](const WaveGroup& group, unsigned axis, bool writes) {
      const AxisSums sums(group, slabs.bins(), axis, range.size(), places);
      const auto cut = best_spatial_split(group, slabs.bins(), slabs.whole(tries_whole), tree_.rules.whole_share,
                                          range.bounds.box.get(), places, axis, axis + 1);
      if (writes) shared_.cuts[axis] = cut;
      if (writes) shared_.crossing[axis] = sums.crossing;
    });
    __syncthreads();
    if (threadIdx.x == 0) {
      const std::uint32_t(&crossing)[3] = shared_.crossing;
      const float share = tree_.rules.whole_share;
      const auto cost = [share](const SpatialSplitRecord& cut) { return cut.compared(share); };
      store_spatial_split(range, cheapest(shared_.cuts, cost), max(crossing[0], max(crossing[1], crossing[2])));
    }
    __syncthreads();
  }
  /// Of the splits across each axis; the first of equals. @param cost of a split.
  template <class Split, class Cost> __device__ static const Split& cheapest(const Split (&splits)[3], Cost&& cost) {
    const Split& first_two = cost(splits[1]) < cost(splits[0]) ? splits[1] : splits[0];
    return cost(splits[2]) < cost(first_two) ? splits[2] : first_two;
  }

  /// The range's node, and its halves: one becomes the range, one waits; small ones are listed.
  __device__ void split() const {
    BlockRange& range = shared_.range;
    TaskCounts sum{range.split.left, 0, 0};
    if (range.kind == SplitKind::kSpatial) {
      count_sides_of(range, part(), shared_.counts);
      sum = shared_.counts;
    }
    const RangeHalves halves = RangeHalves::of(range, sum);
    const SmallRange half[2] = {halves.half(range, 0), halves.half(range, 1)};
    __syncthreads();
    if (threadIdx.x == 0) halves.store(tree_, range);
    __syncthreads();
    const bool goes_on[2] = {half[0].size() > tree_.wave_range, half[1].size() > tree_.wave_range};
    shared_.scatter.move(tree_, range, part(), {0, 0}, goes_on);
    if (threadIdx.x == 0) {
      const unsigned larger = half[0].limit - half[0].begin >= half[1].limit - half[1].begin ? 0 : 1;
      add(half[larger], goes_on[larger], shared_.scatter.sum[larger]);
      add(half[1 - larger], goes_on[1 - larger], shared_.scatter.sum[1 - larger]);
    }
    __syncthreads();
  }

  __device__ void add(const SmallRange& half, bool goes_on, const RangeBox& bounds) const {
    if (goes_on)
      shared_.pending[shared_.pending_count++] =
          PendingRange{bounds, half.begin, half.end, half.limit, half.depth(), half.link, shared_.range.crossing};
    else
      list_small_range(tree_, half);
  }

  /// @return false if nothing waits.
  __device__ bool take() const {
    if (shared_.pending_count == 0) return false;
    __syncthreads();
    if (threadIdx.x == 0) {
      const PendingRange& next = shared_.pending[--shared_.pending_count];
      begin_range(shared_.range, {next.begin, next.end, next.limit, next.link, next.depth, 0.0f}, next.crossing);
      shared_.range.bounds = next.bounds;
    }
    __syncthreads();
    return true;
  }

  const TopDownTree& tree_;
  MediumShared& shared_;
};

/// @param slice of the medium ranges. The ticket is 0 at first.
template <bool kSpatialSplits>
__global__ void __launch_bounds__(kTaskBlock, 3) build_medium(TopDownTree tree, Slice slice) {
  __shared__ MediumShared shared;
  MediumBuilder<kSpatialSplits> builder(tree, shared);
  const std::uint32_t first = slice.begin(tree.state->medium_ranges), last = slice.end(tree.state->medium_ranges);
  for (;;) {
    if (threadIdx.x == 0) shared.ticket = fetch_add(&tree.state->medium_ticket, 1);
    __syncthreads();
    const std::uint32_t number = first + shared.ticket;
    if (number >= last) return;
    builder.build(tree.medium_ranges[number]);
  }
}

}  // namespace hiprt::build::kernels
