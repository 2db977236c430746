#pragma once
/// When a ray tests its leaves, and when the lanes of a wave wait for each other: policies of the traversal loop.

#include <hiprt_device/wave.h>

#include <concepts>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// A leaf is tested when it is met. For hosts.
struct Immediate {
  static constexpr bool kPostponesLeaves = false;
  static constexpr bool kWholeWave = false;
};

/// A ray keeps the first leaf that it meets and goes on through box nodes until every lane of its wave that is still
/// there has a leaf (Aila and Laine, "Understanding the efficiency of ray traversal on GPUs", 2009: speculative
/// while-while). So lanes test boxes together and leaves together. Any lanes may call the traversal.
struct Postponed {
  static constexpr bool kPostponesLeaves = true;
  static constexpr bool kWholeWave = false;
};

/// The same for kernels in which all lanes of a wave trace, together, from beginning to end: trace_batch(). Lanes that
/// are done wait in the loop, so that the votes see everybody; the wave leaves it, to give them new rays, when fewer
/// than kFetchBelow of 32 lanes are busy (dynamic fetch).
/// @tparam kFetchBelow 1: when all are done. Incoherent closest hits gain most from 20 or so.
template <unsigned kFetchBelow = 1> struct WholeWave {
  static_assert(kFetchBelow >= 1 && kFetchBelow <= 32, "WholeWave: kFetchBelow is a number of lanes of 32");
  static constexpr bool kPostponesLeaves = true;
  static constexpr bool kWholeWave = true;

  /// @param may_pause whether there are rays to fetch. The same for all lanes, as is the result.
  HIPRT_HD static HIPRT_INLINE bool leaves(bool busy, bool may_pause) {
    const unsigned lanes = lane_count(whole_wave_ballot(busy));
    return lanes == 0 || (may_pause && lanes * 32 < kFetchBelow * wave_size());
  }
};

template <class T>
concept TraversalSchedule = requires {
  { T::kPostponesLeaves } -> std::convertible_to<bool>;
  { T::kWholeWave } -> std::convertible_to<bool>;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
