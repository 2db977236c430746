#pragma once
/// 32 lanes of a wave as a group (see group.h), whatever the wave's size: so results are the same on every GPU. All
/// functions are called by all lanes of the group together. Internal.

#include <hiprt_device/math/atomic.h>
#include <hiprt_device/math/wave.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace hiprt::build {

class WaveGroup {
 public:
  static constexpr unsigned kLanes = 32;

  template <class T, std::size_t N> using Array = std::array<T, N>;

  /// The group of the calling lane.
  HIPRT_HD HIPRT_FORCE_INLINE WaveGroup() : first_(lane_index() & ~(kLanes - 1)), lane_(lane_index() & (kLanes - 1)) {}

  HIPRT_HD HIPRT_FORCE_INLINE unsigned lane() const { return lane_; }
  /// Lane i: bit i.
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t ballot(bool condition) const {
    return static_cast<std::uint32_t>(group_ballot(lanes(), condition) >> first_);
  }

  HIPRT_HD HIPRT_FORCE_INLINE void sync() const { group_sync(lanes()); }
  HIPRT_HD HIPRT_FORCE_INLINE bool any(bool condition) const { return group_any(lanes(), condition); }
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t from(unsigned lane, std::uint32_t value) const {
    return group_from(lanes(), value, first_ + lane);
  }
  template <class Body> HIPRT_HD HIPRT_FORCE_INLINE void for_lanes_with(bool condition, Body&& body) const {
    for (std::uint32_t left = ballot(condition); left != 0; left &= left - 1) body(highest_bit(left & (~left + 1)));
  }
  template <class Body> HIPRT_HD HIPRT_FORCE_INLINE void for_each(unsigned n, Body&& body) const {
    for (unsigned i = lane_; i < n; i += kLanes) body(i);
  }
  template <class Test> HIPRT_HD HIPRT_FORCE_INLINE unsigned count(unsigned n, Test&& test) const {
    unsigned result = 0;
    for (unsigned i = 0; i < n; i += kLanes) result += lane_count(ballot(i + lane_ < n && test(i + lane_)));
    return result;
  }
  HIPRT_HD HIPRT_FORCE_INLINE void lower(std::uint32_t& value, std::uint32_t candidate) const {
    hiprt::lower(&value, candidate);
  }
  template <class T, std::size_t N, class Keep>
  HIPRT_HD HIPRT_FORCE_INLINE unsigned compact(unsigned n, std::array<T, N>& elements, Keep&& keep) const {
    static_assert(N <= kLanes);
    const bool mine = lane_ < n;
    T element = elements[mine ? lane_ : 0];
    const bool kept = mine && keep(lane_, element);
    const std::uint32_t all = ballot(kept);
    sync();
    if (kept) elements[lane_count(all & ((1u << lane_) - 1))] = element;
    return lane_count(all);
  }

 private:
  HIPRT_HD HIPRT_FORCE_INLINE LaneMask lanes() const { return LaneMask{0xffffffffu} << first_; }

  unsigned first_, lane_;
};

/// Four neighbouring lanes of a wave. All functions are called by all four together.
class LaneTeam {
 public:
  static constexpr unsigned kLanes = 4;

  HIPRT_HD HIPRT_FORCE_INLINE LaneTeam() : first_(lane_index() & ~(kLanes - 1)) {}

  HIPRT_HD HIPRT_FORCE_INLINE unsigned lane() const { return lane_index() - first_; }
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t from(unsigned lane, std::uint32_t value) const {
    return group_from(LaneMask{(1u << kLanes) - 1} << first_, value, first_ + lane);
  }
  HIPRT_HD HIPRT_FORCE_INLINE std::uint64_t from(unsigned lane, std::uint64_t value) const {
    return std::uint64_t{from(lane, static_cast<std::uint32_t>(value >> 32))} << 32 |
           from(lane, static_cast<std::uint32_t>(value));
  }
  /// The sum of the values of the lanes before this one. @param total becomes that of all.
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t before(std::uint32_t value, std::uint32_t& total) const {
    std::uint32_t result = 0;
    total = 0;
    for (unsigned i = 0; i < kLanes; ++i) {
      const std::uint32_t other = from(i, value);
      result += i < lane() ? other : 0;
      total += other;
    }
    return result;
  }

 private:
  unsigned first_;
};

}  // namespace hiprt::build
