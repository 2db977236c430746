#pragma once
/// Builds the subtree over up to 32 references, one in each lane of a group. All ranges of a level are split at once,
/// by an exact sweep along the axes. The references stay sorted along each axis. Internal.

#include <hiprt_build/sah_sbvh/gpu_pending_ranges.h>

namespace hiprt::build::kernels {

/// Shared by the lanes of a group.
struct WaveSweepShared {
  static constexpr unsigned kLanes = WaveGroup::kLanes;

  float min[3][kLanes], max[3][kLanes];  ///< Boxes of references by their slots: lanes that they began in.
  float center[3][kLanes];
  std::uint32_t group[kLanes], primitive[kLanes];
  std::uint32_t order[3][kLanes];  ///< Slots along each axis.
  std::uint32_t left[kLanes];      ///< Whether a slot's reference goes to the left half.

  __device__ Box box(unsigned slot) const {
    Box result;
    for (unsigned k = 0; k < 3; ++k) {
      result.min[k] = min[k][slot];
      result.max[k] = max[k][slot];
    }
    return result;
  }
  __device__ Reference reference(unsigned slot) const {
    return Reference{box(slot), LeafContents{group[slot]}, primitive[slot]};
  }
};

/// @tparam kSpatialSplits ranges whose halves overlap are deferred, because WaveSweep makes no spatial splits.
template <bool kSpatialSplits> class WaveSweep {
 public:
  __device__ WaveSweep(const WaveGroup& group, WaveSweepShared& shared, const TopDownTree& tree, float least_overlap)
      : group_(group), shared_(shared), tree_(tree), least_overlap_(least_overlap) {}

  /// @pre 1 to 32 references. @return how many leaves this lane has written.
  __device__ std::uint32_t build(const SmallRange& range, PendingRanges& pending) {
    load(range);
    bool may_put_off = !range.is(SmallRange::kNoSpatial);
    const std::uint32_t array = range.state & SmallRange::kOther;
    crossing_ = range.crossing();
    std::uint32_t leaves = 0;
    for (;;) {
      leaves += write_leaves() ? 1 : 0;
      if (!group_.any(size() > 1)) return leaves;
      const LaneSplit split = best_split();
      if (kSpatialSplits && may_put_off) put_off(split, array, pending);
      may_put_off = true;
      part(split);
    }
  }

 private:
  /// Of the range that a lane is in.
  struct LaneSplit {
    unsigned middle;  ///< Lane where the right half begins.
    unsigned axis;
    float cost;
    bool overlaps;
    Box box;  ///< Of both halves; known to lane middle.
  };

  __device__ unsigned size() const { return last_ - first_; }
  __device__ unsigned slot_along(unsigned axis) const {
    return axis == 0 ? order_[0] : axis == 1 ? order_[1] : order_[2];
  }

  __device__ void load(const SmallRange& range) {
    const unsigned lane = group_.lane(), n = range.size();
    group_.sync();
    float center[3] = {};
    if (lane < n) {
      const Reference reference = tree_.references[range.is(SmallRange::kOther) ? 1 : 0][range.begin + lane];
      for (unsigned k = 0; k < 3; ++k) {
        shared_.min[k][lane] = reference.box.min[k];
        shared_.max[k][lane] = reference.box.max[k];
        shared_.center[k][lane] = center[k] = split_position(reference.box, k);
      }
      shared_.group[lane] = reference.contents.bits;
      shared_.primitive[lane] = reference.primitive;
    }
    group_.sync();
    unsigned rank[3] = {};
#pragma unroll 1
    for (unsigned i = 0; i < n; ++i)
      for (unsigned k = 0; k < 3; ++k) {
        const float other = shared_.center[k][i];
        rank[k] += other < center[k] || (other == center[k] && i < lane) ? 1 : 0;
      }
    if (lane < n)
      for (unsigned k = 0; k < 3; ++k) shared_.order[k][rank[k]] = lane;
    group_.sync();
    for (unsigned k = 0; k < 3; ++k) order_[k] = lane < n ? shared_.order[k][lane] : lane;
    first_ = lane < n ? 0 : lane;
    last_ = lane < n ? n : lane;
    begin_ = range.begin;
    limit_ = range.limit;
    link_ = range.link;
    depth_ = range.depth();
  }

  /// Ranges of one reference, and of two parts of one. @return whether this lane wrote one.
  __device__ bool write_leaves() {
    const unsigned lane = group_.lane(), other = size() != 2 ? lane : lane == first_ ? lane + 1 : lane - 1;
    const unsigned other_slot = group_.from(other, order_[0]);
    const bool joined = size() == 2 && shared_.primitive[order_[0]] == shared_.primitive[other_slot];
    if (size() != 1 && !joined) return false;
    const bool writes = lane == first_;
    if (writes) {
      Reference reference = shared_.reference(order_[0]);
      grow_fast(reference.box, shared_.box(other_slot));
      tree_.set_leaf(link_, begin_, limit_, reference);
    }
    retire();
    return writes;
  }
  __device__ void retire() { first_ = last_ = group_.lane(); }

  __device__ LaneSplit best_split() const {
    const unsigned lane = group_.lane();
    unsigned steps = 1;
    while (group_.any(size() > 1u << steps)) ++steps;
    LaneChoice best(SimdBox::kInfinity, 0);
    LaneSplit split{};
#pragma unroll 1
    for (unsigned axis = 0; axis < 3; ++axis) {
      const unsigned slot = slot_along(axis), before = group_.from(lane > 0 ? lane - 1 : 0, slot);
      Box right = shared_.box(slot), left = lane > first_ ? shared_.box(before) : empty_box();
      sum_up(group_, left, first_, steps);
      sum_down(group_, right, last_, steps);
      const bool splits = lane > first_ && size() > 1;
      const float cost =
          half_area(left) * static_cast<float>(lane - first_) + half_area(right) * static_cast<float>(last_ - lane);
      // Equal boxes can be split anywhere: the middle makes the flattest tree.
      const unsigned off = 2 * lane > first_ + last_ ? 2 * lane - first_ - last_ : first_ + last_ - 2 * lane;
      const LaneChoice choice(splits ? cost : SimdBox::kInfinity, off << 7 | axis << 5 | lane);
      if (choice.cost < best.cost) {
        best = choice;
        if (kSpatialSplits) {
          Box both = left;
          grow_fast(both, right);
          split.overlaps = halves_overlap(overlap_area(left, right), least_overlap_, half_area(both));
        }
      }
      if (axis == 0) {
        split.box = left;
        grow_fast(split.box, right);
      }
    }
    return agree(split, best, steps);
  }
  /// What is best for all lanes of a range.
  __device__ LaneSplit agree(LaneSplit split, LaneChoice best, unsigned steps) const {
    const unsigned lane = group_.lane();
    for (unsigned k = 0; k < steps; ++k) {
      const bool inside = lane >= first_ + (1u << k);
      best.add(best.from(group_, inside ? lane - (1u << k) : lane), inside);
    }
    best = best.from(group_, last_ > first_ ? last_ - 1 : lane);
    const bool halves = !best.exists() || is_deep(depth_, limit_ - begin_);
    split.middle = halves ? first_ + size() / 2 : best.tie & 31u;
    split.axis = halves ? 0 : best.tie >> 5 & 3u;
    split.cost = best.value();
    if (kSpatialSplits) split.overlaps = group_.from(split.middle & 31u, split.overlaps ? 1u : 0u) != 0 && !halves;
    return split;
  }

  __device__ bool wants_cut(const LaneSplit& split) const {
    return kSpatialSplits && size() >= kLeastCutRange && split.overlaps && limit_ - begin_ > size();
  }
  /// Ranges whose halves overlap go back to memory.
  __device__ void put_off(const LaneSplit& split, std::uint32_t array, PendingRanges& pending) {
    const unsigned lane = group_.lane();
    const bool wants = wants_cut(split);
    const std::uint32_t firsts = group_.ballot(wants && lane == first_);
    if (firsts == 0) return;
    const std::uint32_t behind = firsts & ~((2u << lane) - 1);
    const std::uint32_t next = group_.from(behind != 0 ? lowest_bit(behind) : lane, begin_);
    if (wants) tree_.references[array != 0 ? 1 : 0][begin_ + lane - first_] = shared_.reference(order_[0]);
    if (wants && lane == first_)
      pending.write({begin_, begin_ + size(), limit_, link_,
                     SmallRange::pack(depth_, array | SmallRange::kTrySpatial, crossing_), split.cost},
                    behind != 0 ? next : pending.first);
    pending.first = group_.from(lowest_bit(firsts), begin_);
    if (wants) retire();
  }

  /// Writes the nodes, and brings the references of each half together in all orders.
  __device__ void part(const LaneSplit& split) {
    const unsigned lane = group_.lane();
    const bool splits = size() > 1;
    const unsigned middle = splits ? split.middle : lane;
    const Halves halves(begin_, splits ? limit_ : begin_, middle - first_, last_ - middle, 0.0f, 0.0f);
    const std::uint32_t node = halves.right_begin;
    if (splits && lane == middle) {
      tree_.nodes[node].box = split.box;
      tree_.set(link_, node);
    }
    const bool is_left = lane < middle;
    const unsigned slot = slot_along(split.axis);
    if (splits) shared_.left[slot] = is_left ? 1 : 0;
    group_.sync();
    const std::uint32_t mine = (last_ < 32 ? (1u << last_) - 1 : ~0u) & ~((1u << (first_ & 31u)) - 1);
    for (unsigned axis = 0; axis < 3; ++axis) {
      const bool left = splits && shared_.left[order_[axis]] != 0;
      const std::uint32_t lefts = group_.ballot(left) & mine;
      const unsigned rank = lane_count(lefts & ((1u << lane) - 1));
      const unsigned to = !splits ? lane : left ? first_ + rank : middle + (lane - first_ - rank);
      shared_.order[axis][to] = order_[axis];
    }
    group_.sync();
    for (unsigned axis = 0; axis < 3; ++axis) order_[axis] = shared_.order[axis][lane];
    if (!splits) return;
    if (is_left) {
      last_ = middle;
      limit_ = halves.right_begin;
    } else {
      first_ = middle;
      begin_ = halves.right_begin;
    }
    link_ = 2 * node + (is_left ? 0 : 1);
    ++depth_;
  }

  const WaveGroup& group_;
  WaveSweepShared& shared_;
  const TopDownTree& tree_;
  float least_overlap_;
  unsigned order_[3];      ///< Slot of the reference at this lane's place, along each axis.
  unsigned first_, last_;  ///< Lanes of the range that this lane is in; none: it has nothing to do.
  std::uint32_t begin_, limit_, link_;
  unsigned depth_;
  float crossing_;
};

}  // namespace hiprt::build::kernels
