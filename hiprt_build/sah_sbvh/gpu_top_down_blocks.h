#pragma once
/// What blocks of threads do with references: stable ranks, bounds, and the lists of ranges. Internal.

#include <hiprt_build/sah_sbvh/gpu_top_down_state.h>

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

/// A range whose bounds are not known yet. By one thread.
/// @param crossing of the range above.
inline __device__ void begin_range(BlockRange& to, const SmallRange& range, float crossing) {
  clear(to.bounds);
  to.begin = range.begin;
  to.end = range.end;
  to.limit = range.limit;
  to.depth = range.depth();
  to.link = range.link;
  to.kind = SplitKind::kMedian;
  to.tries_spatial = 0;
  to.crossing = crossing;
}

inline __device__ void list_small_range(const TopDownTree& tree, const SmallRange& range) {
  tree.small_ranges[fetch_add(&tree.state->small_ranges, 1)] = range;
}

/// Lists a range whose bounds are not known yet; a large one with its tasks, for a level. All lanes call it.
/// @param crossing of the range above. @return its number for TopDownTree::range(), or kInvalidId for a small one.
inline __device__ std::uint32_t list_range(const WaveGroup& group, const TopDownTree& tree, unsigned level,
                                           const SmallRange& range, float crossing) {
  TopDownState& state = *tree.state;
  if (range.size() <= tree.wave_range) {
    if (group.lane() == 0) list_small_range(tree, range);
    return kInvalidId;
  }
  const std::uint32_t tasks = (range.size() - 1) / tree.task + 1;
  std::uint32_t number = 0, first_task = 0;
  if (group.lane() == 0) {
    if (tasks == 1) {
      number = fetch_add(&state.medium_ranges, 1) | TopDownTree::kMedium;
    } else {
      number = fetch_add(&state.ranges[level], 1);
      first_task = fetch_add(&state.tasks[level], tasks);
    }
    BlockRange& listed = tree.range(level, number);
    begin_range(listed, range, crossing);
    listed.first_task = first_task;
  }
  number = group.from(0, number);
  if (tasks == 1) return number;
  first_task = group.from(0, first_task);
  for (std::uint32_t i = group.lane(); i < tasks; i += WaveGroup::kLanes)
    tree.tasks[level % 2][first_task + i] = LargeTask{number, range.begin + i * tree.task};
  tree.object_bins(number).clear(group.lane(), WaveGroup::kLanes);
  tree.slab_bins(number).clear(group.lane(), WaveGroup::kLanes);
  tree.whole_slabs(number, tree.tries_whole()).clear(group.lane(), WaveGroup::kLanes);
  return number;
}

}  // namespace hiprt::build::kernels
