#pragma once
/// When a ray tests its leaves, and when it lets the others of its wave go on: policies of the traversal loop.

#include <hiprt_device/wave.h>

#include <concepts>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// A leaf is tested when it is met. For hosts, and for coherent rays.
struct Immediate {
  static constexpr bool kPostponesLeaves = false;
  /// Whether the wave should leave the loop to fetch new rays.
  HIPRT_HD static HIPRT_INLINE bool pause() { return false; }
};

/// A ray keeps the first leaf that it meets and goes on through box nodes until every lane of its wave that is still
/// there has a leaf (Aila and Laine, "Understanding the efficiency of ray traversal on GPUs", 2009: speculative
/// while-while). So lanes test boxes together and leaves together.
/// @tparam kFetchBelow lanes of 32: the wave leaves the loop when fewer are active, for kernels that then give the idle
///         lanes new rays (dynamic fetch). 0: never.
template <unsigned kFetchBelow = 0> struct Postponed {
  static constexpr bool kPostponesLeaves = true;
  HIPRT_HD static HIPRT_INLINE bool pause() {
    if constexpr (kFetchBelow == 0) return false;
    return active_lanes() * 32 < kFetchBelow * wave_size();
  }
};

template <class T>
concept TraversalSchedule = requires {
  { T::kPostponesLeaves } -> std::convertible_to<bool>;
  { T::pause() } -> std::same_as<bool>;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
