#pragma once
/// Climbs the hierarchy of sorted Morton codes without storing it. Every leaf starts a climber. Where two climbers
/// meet, one of them goes on (Apetrei, "Fast and simple agglomerative LBVH construction", 2014). Internal.

#include <hiprt_device/format/node.h>
#include <hiprt_device/math/atomic.h>

#include <cstdint>

namespace hiprt::build {

/// The range of leaves below the node that a climber has reached.
struct Climb {
  std::uint32_t first, last;

  HIPRT_HD explicit Climb(std::uint32_t leaf) : first(leaf), last(leaf) {}

  HIPRT_HD std::uint32_t count() const { return last - first + 1; }

  /// Climbs to the parent node. One boundary lies between the two halves of a node; its number names the node.
  /// @param leaves of the whole hierarchy. @pre count() < leaves
  /// @param levels boundary_level() of the boundaries between leaves i and i + 1.
  /// @param met per boundary: kInvalidId at first, then the far end of the half that arrived first.
  /// @param arrive called with the boundary and whether this is its left half, before the other half can see the
  /// arrival.
  /// @return the boundary, or kInvalidId if the other half has not arrived yet. That half will go on, and can read what
  /// this thread has written.
  template <class Arrive>
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t up(std::uint32_t leaves, const std::uint8_t* levels, std::uint32_t* met,
                                               Arrive&& arrive) {
    const bool left_half = first == 0 || (last != leaves - 1 && levels[last] < levels[first - 1]);
    const std::uint32_t boundary = left_half ? last : first - 1;
    arrive(boundary, left_half);
    const std::uint32_t other_end = exchange(&met[boundary], left_half ? first : last);
    if (other_end == kInvalidId) return kInvalidId;
    if (left_half)
      last = other_end;
    else
      first = other_end;
    return boundary;
  }
};

}  // namespace hiprt::build
