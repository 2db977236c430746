#pragma once
/// Ranges that a group of lanes has still to build, and ranges that it gives to groups without work. Internal.

#include <hiprt_build/sah_sbvh/gpu_top_down_state.h>

namespace hiprt::build::kernels {

/// A range as bytes of a node that only its own subtree will use, so that there is always space.
/// @pre capacity for two references.
class StoredRange {
 public:
  __device__ StoredRange(const TopDownTree& tree, std::uint32_t begin)
      : words_(reinterpret_cast<std::uint32_t*>(tree.nodes + begin + 1)), begin_(begin) {}

  /// By one lane.
  __device__ void write(const SmallRange& range, std::uint32_t next) const {
    words_[0] = range.end;
    words_[1] = range.limit;
    words_[2] = range.link;
    words_[3] = range.state;
    words_[4] = std::bit_cast<std::uint32_t>(range.cost);
    words_[5] = next;
  }
  __device__ SmallRange read() const {
    return {begin_, words_[0], words_[1], words_[2], words_[3], std::bit_cast<float>(words_[4])};
  }
  /// Where the next range of a list begins. It depends on other groups. Who takes the range clears it, so that unused
  /// nodes have the same bytes in every run.
  __device__ std::uint32_t next() const { return words_[5]; }
  __device__ void set_next(std::uint32_t next) const { words_[5] = next; }

 private:
  std::uint32_t* words_;
  std::uint32_t begin_;
};

/// The list of a group.
struct PendingRanges {
  const TopDownTree& tree;
  std::uint32_t first = kInvalidId;  ///< Where it begins.

  /// By one lane. @param next becomes first once this one is taken.
  __device__ void write(const SmallRange& range, std::uint32_t next) const {
    StoredRange(tree, range.begin).write(range, next);
  }
  /// By all lanes. @pre there is one.
  __device__ SmallRange take(const WaveGroup& group) {
    group.sync();
    const StoredRange stored(tree, first);
    const SmallRange range = stored.read();
    drop(group);
    return range;
  }
  /// By all lanes. Leaves out the first one.
  __device__ void drop(const WaveGroup& group) {
    const StoredRange stored(tree, first);
    first = stored.next();
    group.sync();
    if (group.lane() == 0) stored.set_next(kInvalidId);
  }
};

/// Groups that have ranges left give some to groups that wait. Ranges with many spatial splits take much longer than
/// others; without this all other groups would wait for the group that has one. Who builds a range does not change the
/// tree. All lanes of a group call these functions together.
class SharedRanges {
 public:
  /// Ranges that can be given away in a build; later ones stay with their group.
  static constexpr std::uint32_t kMost = 1u << 14;
  /// Words of TopDownState, from `shared` on, that are 0 at first.
  static constexpr std::uint32_t kCounts = 4;

  __device__ SharedRanges(const WaveGroup& group, const TopDownTree& tree) : group_(group), tree_(tree) {}

  /// Gives the first range of the list away, if a group waits.
  __device__ void offer(PendingRanges& pending) const {
    TopDownState& state = *tree_.state;
    if (pending.first == kInvalidId) return;
    bool wanted = false;
    if (group_.lane() == 0) wanted = load_shared(&state.waiting) != 0 && load_shared(&state.shared) < tree_.most_shared;
    if (!group_.any(wanted)) return;
    const std::uint32_t begin = pending.first;
    pending.drop(group_);
    // All lanes have written references.
    finish_writes();
    group_.sync();
    std::uint32_t place = kInvalidId;
    if (group_.lane() == 0) {
      place = fetch_add(&state.shared, 1);
      if (place < tree_.most_shared) {
        fetch_add(&state.unfinished, 1);
        // Whoever finishes the range counts it down after that.
        finish_writes();
        store_shared(tree_.shared_ranges + place, begin);
      } else {
        StoredRange(tree_, begin).set_next(pending.first);
      }
    }
    if (group_.any(place < tree_.most_shared)) return;
    group_.sync();
    pending.first = begin;
  }

  /// Starts to wait. @return false if enough groups wait. They, and the groups that still have ranges, take all that is
  /// given away later.
  __device__ bool wait() {
    TopDownState& state = *tree_.state;
    std::uint32_t place = kInvalidId;
    if (group_.lane() == 0) {
      if (fetch_add(&state.waiting, 1) < kMostWaiting)
        place = fetch_add(&state.shared_ticket, 1);
      else
        fetch_add(&state.waiting, 0xffffffffu);
    }
    place_ = group_.from(0, place);
    return place_ < tree_.most_shared;
  }
  /// @pre wait(). @return whether it has a range, which ends the waiting.
  __device__ bool take(SmallRange& range) const {
    std::uint32_t begin = kInvalidId;
    if (group_.lane() == 0) begin = load_shared(tree_.shared_ranges + place_);
    begin = group_.from(0, begin);
    if (begin == kInvalidId) return false;
    see_writes();
    if (group_.lane() == 0) fetch_add(&tree_.state->waiting, 0xffffffffu);
    range = StoredRange(tree_, begin).read();
    return true;
  }
  /// A range and all below it is done, or was given away.
  __device__ void finish_range() const {
    if (group_.lane() == 0) fetch_add(&tree_.state->unfinished, 0xffffffffu);
  }
  /// Whether all ranges are done. @param ranges that were there at first.
  __device__ bool is_over(std::uint32_t ranges) const {
    bool over = false;
    if (group_.lane() == 0) over = load_shared(&tree_.state->unfinished) + ranges == 0;
    return group_.any(over);
  }

 private:
  static constexpr std::uint32_t kMostWaiting = 1024;  ///< More would only read the same words.

  const WaveGroup& group_;
  const TopDownTree& tree_;
  std::uint32_t place_ = kInvalidId;
};

}  // namespace hiprt::build::kernels
