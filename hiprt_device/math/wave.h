#pragma once
/// The lanes that run together: a wave (AMD, 32 or 64 lanes), a warp (NVIDIA, 32 lanes), or one lane on a host.
///
/// All functions consider the lanes that are active where they are called.

#include <hiprt_device/format/portability.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Bit per lane.
using LaneMask = std::uint64_t;

/// Number of lanes of a wave.
HIPRT_HD HIPRT_FORCE_INLINE unsigned wave_size() {
#if HIPRT_DEVICE_CODE
  return static_cast<unsigned>(warpSize);
#else
  return 1;
#endif
}

/// This lane's number in its wave, below wave_size().
HIPRT_HD HIPRT_FORCE_INLINE unsigned lane_index() {
#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__)
  return static_cast<unsigned>(__lane_id());
#elif HIPRT_DEVICE_CODE
  unsigned lane;
  asm("mov.u32 %0, %%laneid;" : "=r"(lane));
  return lane;
#else
  return 0;
#endif
}

/// The active lanes for which the condition holds.
HIPRT_HD HIPRT_FORCE_INLINE LaneMask wave_ballot(bool condition) {
#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__)
  return __ballot(condition);
#elif HIPRT_DEVICE_CODE
  return __ballot_sync(__activemask(), condition);
#else
  return condition ? 1u : 0u;
#endif
}

/// For a branch that does no harm to lanes that do not need it.
/// @return on AMD whether the condition holds for any lane: the wave then branches as a whole, without saving and
/// restoring its mask of lanes. Elsewhere the condition.
HIPRT_HD HIPRT_FORCE_INLINE bool needed_by_a_lane(bool condition) {
#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__)
  return __ballot(condition) != 0;
#else
  return condition;
#endif
}

/// Every lane of a wave.
inline constexpr LaneMask kWholeWave = ~LaneMask{0};

/// Those of @p lanes for which the condition holds. All of @p lanes must call this; it brings them together.
HIPRT_HD HIPRT_FORCE_INLINE LaneMask group_ballot(LaneMask lanes, bool condition) {
#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__)
  return __ballot(condition) & lanes;
#elif HIPRT_DEVICE_CODE
  return __ballot_sync(static_cast<unsigned>(lanes), condition);
#else
  return condition ? lanes & 1u : 0u;
#endif
}
HIPRT_HD HIPRT_FORCE_INLINE bool group_any(LaneMask lanes, bool condition) {
#if HIPRT_DEVICE_CODE && !defined(__HIP_DEVICE_COMPILE__)
  return __any_sync(static_cast<unsigned>(lanes), condition);
#else
  return group_ballot(lanes, condition) != 0;
#endif
}

/// Makes writes of @p lanes visible to all of them. All of @p lanes must call this; it brings them together.
HIPRT_HD HIPRT_FORCE_INLINE void group_sync(LaneMask lanes) {
#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__)
  static_cast<void>(lanes);
  __builtin_amdgcn_fence(__ATOMIC_ACQ_REL, "wavefront");
  __builtin_amdgcn_wave_barrier();
  __builtin_amdgcn_fence(__ATOMIC_ACQ_REL, "wavefront");
#elif HIPRT_DEVICE_CODE
  __syncwarp(static_cast<unsigned>(lanes));
#else
  static_cast<void>(lanes);
#endif
}

/// The value of one of @p lanes. All of them must call this.
/// @param lane its number in the wave.
HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t group_from(LaneMask lanes, std::uint32_t value, unsigned lane) {
#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__)
  static_cast<void>(lanes);
  return static_cast<std::uint32_t>(__builtin_amdgcn_ds_bpermute(static_cast<int>(lane * 4), static_cast<int>(value)));
#elif HIPRT_DEVICE_CODE
  return __shfl_sync(static_cast<unsigned>(lanes), value, static_cast<int>(lane));
#else
  static_cast<void>(lanes);
  static_cast<void>(lane);
  return value;
#endif
}

/// Number of bits that are set.
HIPRT_HD HIPRT_FORCE_INLINE unsigned lane_count(LaneMask lanes) {
#if HIPRT_DEVICE_CODE
  return static_cast<unsigned>(__popcll(lanes));
#else
  return static_cast<unsigned>(__builtin_popcountll(lanes));
#endif
}

/// Number of the highest bit that is set. @pre mask != 0
HIPRT_HD HIPRT_FORCE_INLINE unsigned highest_bit(std::uint64_t mask) {
#if HIPRT_DEVICE_CODE
  return 63u - static_cast<unsigned>(__clzll(static_cast<long long>(mask)));
#else
  return 63u - static_cast<unsigned>(__builtin_clzll(mask));
#endif
}

/// Number of @p lanes before this one.
HIPRT_HD HIPRT_FORCE_INLINE unsigned lanes_before(LaneMask lanes) {
  return lane_count(lanes & ((LaneMask{1} << lane_index()) - 1));
}

/// The value of the lowest of the lanes.
/// @pre all of them are active and call this.
HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t from_first_lane(LaneMask lanes, std::uint32_t value) {
#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__)
  static_cast<void>(lanes);
  return static_cast<std::uint32_t>(__builtin_amdgcn_readfirstlane(static_cast<int>(value)));
#elif HIPRT_DEVICE_CODE
  return __shfl_sync(static_cast<unsigned>(lanes), value, __ffs(static_cast<int>(lanes)) - 1);
#else
  static_cast<void>(lanes);
  return value;
#endif
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
