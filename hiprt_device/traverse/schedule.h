#pragma once
/// When a ray tests its leaves, and when the lanes of a wave wait for each other: policies of the traversal loop.

#include <hiprt_device/math/wave.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// A leaf is tested when it is met. For hosts.
struct Immediate {
  static constexpr bool kTogether = false;
  static constexpr bool kBatchOnly = false;
  HIPRT_HD static constexpr LaneMask group() { return 1; }
};

/// A ray keeps the first leaf that it meets and goes on through box nodes until every lane of its group has a leaf or
/// nothing to visit (Aila and Laine, "Understanding the efficiency of ray traversal on GPUs", 2009: speculative
/// while-while). So lanes test boxes together and leaves together. The group is the lanes that call the traversal
/// together; those that are done wait in the loop for the others, which keeps the group one.
struct Postponed {
  static constexpr bool kTogether = true;
  static constexpr bool kBatchOnly = false;
  HIPRT_HD static HIPRT_INLINE LaneMask group() { return wave_ballot(true); }
  HIPRT_HD static HIPRT_INLINE bool search_on(LaneMask group, bool searches) { return group_any(group, searches); }
  HIPRT_HD static HIPRT_INLINE bool leaves(LaneMask group, bool busy, bool) { return !group_any(group, busy); }
};

/// The same for kernels in which all lanes of a wave trace from beginning to end, through trace_batch(): the wave
/// leaves the loop, to give idle lanes new rays, when fewer than kFetchBelow of 32 lanes are busy (dynamic fetch).
/// @tparam kFetchBelow 1: when all are done.
/// @tparam kSearchAbove leaves are tested as soon as no more than so many of 32 lanes look for one: a few stragglers
///         need not keep the others waiting.
template <unsigned kFetchBelow = 12, unsigned kSearchAbove = 4> struct WholeWave {
  static_assert(kFetchBelow >= 1 && kFetchBelow <= 32, "WholeWave: kFetchBelow is a number of lanes of 32");
  static_assert(kSearchAbove < 32, "WholeWave: kSearchAbove is a number of lanes of 32");
  static constexpr bool kTogether = true;
  static constexpr bool kBatchOnly = true;
  HIPRT_HD static constexpr LaneMask group() { return kWholeWave; }
  /// Whether to go on through box nodes. @param searches whether this lane looks for a leaf.
  HIPRT_HD static HIPRT_INLINE bool search_on(LaneMask group, bool searches) {
    if constexpr (kSearchAbove == 0) return group_any(group, searches);
    return lane_count(group_ballot(group, searches)) > kSearchAbove * wave_size() / 32;
  }
  /// @param may_pause whether there are rays to fetch. The same for all lanes, as is the result.
  HIPRT_HD static HIPRT_INLINE bool leaves(LaneMask group, bool busy, bool may_pause) {
    const unsigned lanes = lane_count(group_ballot(group, busy));
    return lanes == 0 || (may_pause && lanes < (kFetchBelow * wave_size() + 31) / 32);
  }
};

/// The votes of a schedule whose lanes wait for each other: whether to go on through box nodes, and whether to leave
/// the loop.
template <class T>
concept VotingSchedule = requires(LaneMask group, bool searches, bool busy, bool may_pause) {
  { T::search_on(group, searches) } -> std::same_as<bool>;
  { T::leaves(group, busy, may_pause) } -> std::same_as<bool>;
};

/// What Policies::Schedule must be: one of the above. kTogether: whether lanes wait for each other; kBatchOnly: whether
/// only trace_batch() may use it; group(): the lanes that do it together.
template <class T>
concept TraversalSchedule = requires {
  typename std::bool_constant<T::kTogether>;
  typename std::bool_constant<T::kBatchOnly>;
  { T::group() } -> std::same_as<LaneMask>;
  requires(!T::kTogether || VotingSchedule<T>);
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
