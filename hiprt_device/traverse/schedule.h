#pragma once
/// Schedules: policies that decide when a ray tests its leaves, and when the lanes of a wave wait for each other.

#include <hiprt_device/math/wave.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Tests a leaf as soon as the ray meets it. For hosts.
struct Immediate {
  static constexpr bool kTogether = false;
  static constexpr bool kBatchOnly = false;
  HIPRT_HD static constexpr LaneMask group() { return 1; }
};

/// Postpones leaf tests until all lanes of a group have a leaf, or nothing to visit.
///
/// A ray keeps the first leaf that it meets and continues through box nodes. So the lanes test boxes together, and
/// then leaves together: speculative while-while (Aila and Laine, "Understanding the efficiency of ray traversal on
/// GPUs", 2009). The group is the lanes that call the traversal together. A lane that is done waits in the loop for
/// the others, so the group stays the same.
struct Postponed {
  static constexpr bool kTogether = true;
  static constexpr bool kBatchOnly = false;
  HIPRT_HD static HIPRT_FORCE_INLINE LaneMask group() { return wave_ballot(true); }
  HIPRT_HD static HIPRT_FORCE_INLINE bool search_on(LaneMask group, bool searches) {
    return group_any(group, searches);
  }
  HIPRT_HD static HIPRT_FORCE_INLINE bool leaves(LaneMask group, bool busy, bool) { return !group_any(group, busy); }
};

/// Postpones leaf tests in batches (trace_batch()), where all lanes of a wave trace from beginning to end.
///
/// The wave leaves the loop when fewer than kFetchBelow of 32 lanes are busy. The idle lanes then get new rays
/// (dynamic fetch).
/// @tparam kFetchBelow 1: the wave leaves the loop when all lanes are done.
/// @tparam kSearchAbove the lanes test leaves as soon as at most so many of 32 lanes still search one. So a few slow
/// lanes do not make the others wait.
template <unsigned kFetchBelow = 12, unsigned kSearchAbove = 4> struct WholeWave {
  static_assert(kFetchBelow >= 1 && kFetchBelow <= 32, "hiprt: WholeWave: kFetchBelow must be from 1 to 32");
  static_assert(kSearchAbove < 32, "hiprt: WholeWave: kSearchAbove must be below 32");
  static constexpr bool kTogether = true;
  static constexpr bool kBatchOnly = true;
  /// Nodes that a lane visits between two votes. With one level of instances at most 2, with more 1. On AMD it has not
  /// been measured.
#if defined(__CUDA_ARCH__)
  static constexpr unsigned kVisits = 3;
#else
  static constexpr unsigned kVisits = 1;
#endif
  HIPRT_HD static constexpr LaneMask group() { return kWholeWave; }
  /// Whether to continue through box nodes.
  /// @param searches whether this lane searches a leaf.
  HIPRT_HD static HIPRT_FORCE_INLINE bool search_on(LaneMask group, bool searches) {
    if constexpr (kSearchAbove == 0) return group_any(group, searches);
    return lane_count(group_ballot(group, searches)) > kSearchAbove * wave_size() / 32;
  }
  /// @param may_pause whether there are rays to fetch. It is the same for all lanes, as is the result.
  HIPRT_HD static HIPRT_FORCE_INLINE bool leaves(LaneMask group, bool busy, bool may_pause) {
    const unsigned lanes = lane_count(group_ballot(group, busy));
    return lanes == 0 || (may_pause && lanes < (kFetchBelow * wave_size() + 31) / 32);
  }
};

/// The votes of a schedule whose lanes wait for each other: search_on() whether to continue through box nodes,
/// leaves() whether to leave the loop.
template <class T>
concept VotingSchedule = requires(LaneMask group, bool searches, bool busy, bool may_pause) {
  { T::search_on(group, searches) } -> std::same_as<bool>;
  { T::leaves(group, busy, may_pause) } -> std::same_as<bool>;
};

/// The requirement of Policies::Schedule.
///
/// kTogether says whether lanes wait for each other. kBatchOnly says whether only trace_batch() may use the schedule.
/// group() returns the lanes that wait for each other. kVisits, if there is one, is the number of nodes that a lane
/// visits between two calls of search_on(); with instances fewer.
template <class T>
concept TraversalSchedule = requires {
  typename std::bool_constant<T::kTogether>;
  typename std::bool_constant<T::kBatchOnly>;
  { T::group() } -> std::same_as<LaneMask>;
  requires(!T::kTogether || VotingSchedule<T>);
};

/// Nodes that a lane visits between two calls of search_on().
template <class Schedule> inline constexpr unsigned kVisitsOf = 1;
template <class Schedule>
requires requires { Schedule::kVisits; }
inline constexpr unsigned kVisitsOf<Schedule> = Schedule::kVisits;

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
