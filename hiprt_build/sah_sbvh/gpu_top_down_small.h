#pragma once
/// Subtrees that a group of lanes builds alone, depth first. Internal.

#include <hiprt_build/sah_sbvh/gpu_wave_sweep.h>

namespace hiprt::build::kernels {

/// Shared memory of a group: bins, or the data of WaveSweep.
struct SmallShared {
  union {
    std::uint32_t object_words[ObjectBins::kSize];
    struct {
      std::uint32_t words[SlabBins::kSize], whole_words[WholeSlabs::kSize];
      SlabPlanes planes;
      SlabGroups groups;
      SlabQueue<WaveGroup::kLanes> queue;
    } slabs;
    WaveSweepShared sweep;
  };
};

/// @tparam kSpatialSplits whether spatial splits are allowed.
template <bool kSpatialSplits> class SmallBuilder {
 public:
  __device__ SmallBuilder(const WaveGroup& group, SmallShared& shared, const TopDownTree& tree,
                          const SharedRanges& ranges)
      : group_(group),
        shared_(shared),
        tree_(tree),
        ranges_(ranges),
        pending_{tree},
        least_overlap_(tree.least_overlap()) {}

  /// @return how many leaves this lane has written.
  __device__ std::uint32_t build(SmallRange range) {
    std::uint32_t leaves = 0;
    for (;;) {
      const bool many = range.size() > WaveGroup::kLanes || (kSpatialSplits && range.is(SmallRange::kTrySpatial));
      if (!many || !split(range, leaves)) {
        if (many) range.state = (range.state & ~SmallRange::kTrySpatial) | SmallRange::kNoSpatial;
        leaves += WaveSweep<kSpatialSplits>(group_, shared_.sweep, tree_, least_overlap_).build(range, pending_);
      }
      if (pending_.first == kInvalidId) return leaves;
      range = pending_.take(group_);
      ranges_.offer(pending_);
    }
  }

 private:
  struct Rule {
    SplitKind kind;
    ObjectSplit objects;
    SpatialSplitRecord spatial;
    Box box, centers;
    float crossing;  ///< As BlockRange::crossing.
  };

  __device__ const Reference* from(const SmallRange& range) const {
    return tree_.references[range.is(SmallRange::kOther) ? 1 : 0];
  }

  /// visit(reference) by the lanes in turn.
  template <class Visit> __device__ void for_each(const SmallRange& range, Visit&& visit) const {
    const Reference* references = from(range);
    for (std::uint32_t i = range.begin + group_.lane(); i < range.end; i += WaveGroup::kLanes)
      visit(load(references + i));
  }

  __device__ void measure(const SmallRange& range, Rule& rule) const {
    Box box = empty_box(), centers = empty_box();
    for_each(range, [&](const Reference& r) {
      grow_fast(box, r.box);
      Box center;
      for (unsigned k = 0; k < 3; ++k) center.min[k] = center.max[k] = split_position(r.box, k);
      grow_fast(centers, center);
    });
    rule.box = unite_lanes(group_, box);
    rule.centers = unite_lanes(group_, centers);
  }

  __device__ void choose_object(const SmallRange& range, Rule& rule) const {
    const ObjectBins bins{shared_.object_words};
    group_.sync();
    bins.clear(group_.lane(), WaveGroup::kLanes);
    group_.sync();
    const BinMapping mapping = lane_mapping(rule.centers);
    for_each(range, [&](const Reference& r) { bin_object(bins, mapping, r.box); });
    group_.sync();
    rule.objects = best_object_split(group_, bins, rule.box);
    rule.kind = rule.objects.axis == ObjectSplit::kNoAxis ? SplitKind::kMedian : SplitKind::kObject;
  }

  /// Not in crowded ranges (TopDownTree::tries_whole()).
  __device__ WholeSlabs whole(const SmallRange& range) const {
    return WholeSlabs{shared_.slabs.whole_words, tree_.tries_whole() && !range.is_crowded()};
  }

  /// @param counts whether references are counted, too.
  __device__ void bin_parts(const SmallRange& range, bool counts) const {
    const SlabGroups& groups = shared_.slabs.groups;
    const SlabBins bins{shared_.slabs.words};
    const SlabPlanes& planes = shared_.slabs.planes;
    SlabQueue<WaveGroup::kLanes>& queue = shared_.slabs.queue;
    const Reference* references = from(range) + range.begin;
    for (std::uint32_t first = 0; first < range.size(); first += WaveGroup::kLanes) {
      const std::uint32_t i = first + group_.lane();
      if (i < range.size()) queue.add(bins, whole(range), planes, groups, load(references + i), i, counts);
      group_.sync();
      queue.work(bins, planes, groups, tree_.geometries, group_.lane(),
                 [&](unsigned number) { return load(references + number); });
      group_.sync();
      if (group_.lane() == 0) queue.clear();
      group_.sync();
    }
  }

  /// Takes a spatial split if it is cheaper.
  __device__ void choose_spatial(const SmallRange& range, Rule& rule) const {
    const SlabBins bins{shared_.slabs.words};
    group_.sync();
    bins.clear(group_.lane(), WaveGroup::kLanes);
    whole(range).clear(group_.lane(), WaveGroup::kLanes);
    SlabPlanes& planes = shared_.slabs.planes;
    fill_planes(planes, rule.box, group_.lane(), WaveGroup::kLanes);
    SlabGroups& groups = shared_.slabs.groups;
    if (group_.lane() == 0) {
      shared_.slabs.queue.clear();
      groups = SlabGroups::single();
    }
    group_.sync();
    const std::uint32_t places = range.limit - range.begin;
    const bool counts_first = range.is_crowded();
    if (counts_first) {
      for_each(range, [&](const Reference& r) { count_ends(bins, planes, r.box); });
      group_.sync();
      const SlabSums sums = sum_slabs(group_, bins, range.size(), places);
      rule.crossing = crossing_share(sums.crossing, range.size());
      if (!sums.groups.has_planes()) return;
      if (group_.lane() == 0) groups = sums.groups;
      group_.sync();
    }
    bin_parts(range, !counts_first);
    rule.spatial = best_spatial_split(group_, bins, whole(range), tree_.rules.whole_share, rule.box, places);
    rule.crossing = crossing_share(sum_slabs(group_, bins, range.size(), places).crossing, range.size());
    if (rule.spatial.cost < rule.objects.cost) rule.kind = SplitKind::kSpatial;
  }

  __device__ static unsigned sides(const Rule& rule, const BinMapping& mapping, std::uint32_t half,
                                   const Reference& reference, std::uint32_t place) {
    if (kSpatialSplits && rule.kind == SplitKind::kSpatial) return spatial_sides(rule.spatial, reference.box);
    const bool left = rule.kind == SplitKind::kMedian ? place < half : goes_left(rule.objects, mapping, reference.box);
    return left ? kLeftSide : kRightSide;
  }

  /// @param right becomes the number of references on the right side. @return that on the left.
  __device__ std::uint32_t count(const SmallRange& range, const Rule& rule, std::uint32_t& right) const {
    const BinMapping mapping = lane_mapping(rule.centers);
    const std::uint32_t half = range.begin + range.size() / 2;
    std::uint32_t counts[2] = {};
    for (std::uint32_t first = range.begin; first < range.end; first += WaveGroup::kLanes) {
      const std::uint32_t i = first + group_.lane();
      const unsigned mine = i < range.end ? sides(rule, mapping, half, load(from(range) + i), i) : 0;
      counts[0] += lane_count(group_.ballot((mine & kLeftSide) != 0));
      counts[1] += lane_count(group_.ballot((mine & kRightSide) != 0));
    }
    right = counts[1];
    return counts[0];
  }

  __device__ void move(const SmallRange& range, const Rule& rule, const Halves& halves) const {
    const BinMapping mapping = lane_mapping(rule.centers);
    const std::uint32_t half = range.begin + range.size() / 2;
    Reference* to = tree_.references[range.is(SmallRange::kOther) ? 0 : 1];
    std::uint32_t next[2] = {range.begin, halves.right_begin};
    for (std::uint32_t first = range.begin; first < range.end; first += WaveGroup::kLanes) {
      const std::uint32_t i = first + group_.lane();
      Reference r{};
      if (i < range.end) r = load(from(range) + i);
      const unsigned mine = i < range.end ? sides(rule, mapping, half, r, i) : 0;
      Parts parts{r.box, r.box};
      if (kSpatialSplits && mine == (kLeftSide | kRightSide))
        parts = split_reference(tree_.geometries, r, rule.spatial.axis, rule.spatial.plane);
      for (unsigned side = 0; side < 2; ++side) {
        const bool goes = (mine >> side & 1u) != 0;
        const std::uint32_t lanes = group_.ballot(goes);
        const std::uint32_t rank = lane_count(lanes & ((1u << group_.lane()) - 1));
        if (goes) to[next[side] + rank] = Reference{side == 0 ? parts.left : parts.right, r.contents, r.primitive};
        next[side] += lane_count(lanes);
      }
    }
  }

  __device__ void choose(const SmallRange& range, Rule& rule) const {
    measure(range, rule);
    rule.kind = SplitKind::kMedian;
    rule.crossing = range.crossing();
    rule.objects = {range.cost, ObjectSplit::kNoAxis, 0, SimdBox::kInfinity, 0, 0.0f, 0.0f};
    if (is_deep(range.depth(), range.limit - range.begin)) return;
    if (!range.is(SmallRange::kTrySpatial)) choose_object(range, rule);
    if (kSpatialSplits && range.size() >= kLeastCutRange && range.limit - range.begin > range.size() &&
        halves_overlap(rule.objects.overlap, least_overlap_, half_area(rule.box)))
      choose_spatial(range, rule);
  }

  /// Both halves become pending ranges or leaves. @return false, with nothing done, if the range should get a spatial
  /// split and there is none.
  __device__ bool split(const SmallRange& range, std::uint32_t& leaves) {
    Rule rule{};
    choose(range, rule);
    std::uint32_t left = 0, right = 0;
    float left_area = 0.0f, right_area = 0.0f;
    if (kSpatialSplits && rule.kind == SplitKind::kSpatial) {
      left = count(range, rule, right);
      left_area = half_area(rule.spatial.left);
      right_area = half_area(rule.spatial.right);
      if (left == 0 || right == 0)
        rule.kind = rule.objects.axis == ObjectSplit::kNoAxis ? SplitKind::kMedian : SplitKind::kObject;
    }
    if (kSpatialSplits && range.is(SmallRange::kTrySpatial) && rule.kind != SplitKind::kSpatial) return false;
    if (rule.kind == SplitKind::kObject) {
      left = rule.objects.left;
      right = range.size() - left;
      left_area = rule.objects.left_area;
      right_area = rule.objects.right_area;
    }
    if (rule.kind == SplitKind::kMedian) {
      left = range.size() / 2;
      right = range.size() - left;
      left_area = right_area = 0.0f;
    }
    const Halves halves(range.begin, range.limit, left, right, left_area, right_area);
    move(range, rule, halves);
    group_.sync();
    const std::uint32_t node = halves.right_begin;
    if (group_.lane() == 0) {
      tree_.nodes[node].box = rule.box;
      tree_.set(range.link, node);
    }
    const std::uint32_t bits =
        SmallRange::pack(range.depth() + 1, range.is(SmallRange::kOther) ? 0 : SmallRange::kOther, rule.crossing);
    add({node, halves.right_end, range.limit, 2 * node + 1, bits, 0.0f}, leaves);
    add({range.begin, halves.left_end, node, 2 * node, bits, 0.0f}, leaves);
    return true;
  }

  /// A half.
  __device__ void add(const SmallRange& range, std::uint32_t& leaves) {
    if (range.size() > 1) {
      if (group_.lane() == 0) pending_.write(range, pending_.first);
      pending_.first = range.begin;
    } else if (group_.lane() == 0) {
      tree_.set_leaf(range.link, range.begin, range.limit, load(from(range) + range.begin));
      ++leaves;
    }
  }

  const WaveGroup& group_;
  SmallShared& shared_;
  const TopDownTree& tree_;
  const SharedRanges& ranges_;
  PendingRanges pending_;
  float least_overlap_;
};

/// Groups take a small range after the other, and then ranges from groups that have more.
/// @param slice of the small ranges. The ticket and the state of SharedRanges are as at first.
template <bool kSpatialSplits>
__global__ void __launch_bounds__(kGroupBlock, 4) build_small(TopDownTree tree, Slice slice) {
  __shared__ SmallShared shared[kGroupsPerBlock];
  const WaveGroup group;
  const std::uint32_t first = slice.begin(tree.state->small_ranges);
  const std::uint32_t ranges = slice.end(tree.state->small_ranges) - first;
  SharedRanges shared_ranges(group, tree);
  SmallBuilder<kSpatialSplits> builder(group, shared[threadIdx.x / WaveGroup::kLanes], tree, shared_ranges);
  std::uint32_t leaves = 0;
  // Of two groups in a wave one may wait for the other: each turn waits once and builds once.
  for (bool waits = false;;) {
    SmallRange range{};
    bool has = false;
    if (!waits) {
      std::uint32_t ticket = group.lane() == 0 ? fetch_add(&tree.state->ticket, 1) : 0;
      ticket = group.from(0, ticket);
      has = ticket < ranges;
      if (has) range = tree.small_ranges[first + ticket];
      if (!has && !shared_ranges.wait()) break;
      waits = !has;
    }
    if (waits) {
      has = shared_ranges.take(range);
      if (!has && shared_ranges.is_over(ranges)) break;
      waits = !has;
    }
    if (!has) continue;
    leaves += builder.build(range);
    shared_ranges.finish_range();
  }
  leaves = sum_up(group, leaves);
  if (group.lane() == WaveGroup::kLanes - 1 && leaves != 0) fetch_add(tree.leaves, leaves);
}

}  // namespace hiprt::build::kernels
