#pragma once
/// Atomic operations on memory that threads share: of the device, or of the host's process.

#include <hiprt_device/format/portability.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// *value += amount, without ordering of other memory.
/// @return the value before.
HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t fetch_add(std::uint32_t* value, std::uint32_t amount) {
#if HIPRT_DEVICE_CODE
  return atomicAdd(value, amount);
#else
  return __atomic_fetch_add(value, amount, __ATOMIC_RELAXED);
#endif
}

/// The same in 64 bits.
HIPRT_HD HIPRT_FORCE_INLINE std::uint64_t fetch_add(std::uint64_t* value, std::uint64_t amount) {
#if HIPRT_DEVICE_CODE
  return atomicAdd(reinterpret_cast<unsigned long long*>(value), static_cast<unsigned long long>(amount));
#else
  return __atomic_fetch_add(value, amount, __ATOMIC_RELAXED);
#endif
}

/// *value += amount. A thread that adds after another thread can also read what that thread wrote before.
/// @return the value before.
HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t fetch_add_ordered(std::uint32_t* value, std::uint32_t amount) {
#if HIPRT_DEVICE_CODE
  __threadfence();
  const std::uint32_t before = atomicAdd(value, amount);
  __threadfence();
  return before;
#else
  return __atomic_fetch_add(value, amount, __ATOMIC_ACQ_REL);
#endif
}

/// *value = max(*value, candidate), without ordering of other memory.
HIPRT_HD HIPRT_FORCE_INLINE void raise(std::uint64_t* value, std::uint64_t candidate) {
#if HIPRT_DEVICE_CODE
  static_assert(sizeof(unsigned long long) == sizeof(std::uint64_t));
  atomicMax(reinterpret_cast<unsigned long long*>(value), static_cast<unsigned long long>(candidate));
#else
  std::uint64_t there = __atomic_load_n(value, __ATOMIC_RELAXED);
  while (there < candidate &&
         !__atomic_compare_exchange_n(value, &there, candidate, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
#endif
}

/// The same in 32 bits.
HIPRT_HD HIPRT_FORCE_INLINE void raise(std::uint32_t* value, std::uint32_t candidate) {
#if HIPRT_DEVICE_CODE
  atomicMax(value, candidate);
#else
  std::uint32_t there = __atomic_load_n(value, __ATOMIC_RELAXED);
  while (there < candidate &&
         !__atomic_compare_exchange_n(value, &there, candidate, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
#endif
}

/// *value = min(*value, candidate), without ordering of other memory.
HIPRT_HD HIPRT_FORCE_INLINE void lower(std::uint32_t* value, std::uint32_t candidate) {
#if HIPRT_DEVICE_CODE
  atomicMin(value, candidate);
#else
  std::uint32_t there = __atomic_load_n(value, __ATOMIC_RELAXED);
  while (candidate < there &&
         !__atomic_compare_exchange_n(value, &there, candidate, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
#endif
}

/// *value = min(*value, candidate) in 64 bits, without ordering of other memory.
HIPRT_HD HIPRT_FORCE_INLINE void lower(std::uint64_t* value, std::uint64_t candidate) {
#if HIPRT_DEVICE_CODE
  atomicMin(reinterpret_cast<unsigned long long*>(value), static_cast<unsigned long long>(candidate));
#else
  std::uint64_t there = __atomic_load_n(value, __ATOMIC_RELAXED);
  while (candidate < there &&
         !__atomic_compare_exchange_n(value, &there, candidate, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
#endif
}

/// *value |= bits, without ordering of other memory.
HIPRT_HD HIPRT_FORCE_INLINE void set_bits(std::uint32_t* value, std::uint32_t bits) {
#if HIPRT_DEVICE_CODE
  atomicOr(value, bits);
#else
  __atomic_fetch_or(value, bits, __ATOMIC_RELAXED);
#endif
}

/// *value = replacement if it is @p expected, without ordering of other memory.
/// @return the value before.
HIPRT_HD HIPRT_FORCE_INLINE std::uint64_t compare_exchange(std::uint64_t* value, std::uint64_t expected,
                                                           std::uint64_t replacement) {
#if HIPRT_DEVICE_CODE
  return atomicCAS(reinterpret_cast<unsigned long long*>(value), static_cast<unsigned long long>(expected),
                   static_cast<unsigned long long>(replacement));
#else
  __atomic_compare_exchange_n(value, &expected, replacement, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED);
  return expected;
#endif
}

/// The value that other threads of the device have stored, not one that this thread has read before. Without ordering
/// of other memory.
template <class Integer> HIPRT_HD HIPRT_FORCE_INLINE Integer load_shared(const Integer* value) {
  static_assert(sizeof(Integer) == 4 || sizeof(Integer) == 8);
#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__)
  return __hip_atomic_load(value, __ATOMIC_RELAXED, __HIP_MEMORY_SCOPE_AGENT);
#elif HIPRT_DEVICE_CODE
  return *static_cast<const volatile Integer*>(value);
#else
  return __atomic_load_n(value, __ATOMIC_RELAXED);
#endif
}

/// Stores a value for load_shared() of other threads.
template <class Integer> HIPRT_HD HIPRT_FORCE_INLINE void store_shared(Integer* value, Integer replacement) {
#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__)
  __hip_atomic_store(value, replacement, __ATOMIC_RELAXED, __HIP_MEMORY_SCOPE_AGENT);
#elif HIPRT_DEVICE_CODE
  *static_cast<volatile Integer*>(value) = replacement;
#else
  __atomic_store_n(value, replacement, __ATOMIC_RELAXED);
#endif
}

/// *value = replacement. A thread that reads an exchanged value can also read what that thread wrote before.
/// @return the value before.
HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t exchange(std::uint32_t* value, std::uint32_t replacement) {
#if HIPRT_DEVICE_CODE
  __threadfence();
  const std::uint32_t before = atomicExch(value, replacement);
  __threadfence();
  return before;
#else
  return __atomic_exchange_n(value, replacement, __ATOMIC_ACQ_REL);
#endif
}

/// Takes the lock if it is free (0). What the last holder wrote can then be read.
/// @return whether it was taken.
HIPRT_HD HIPRT_FORCE_INLINE bool try_lock(std::uint32_t* lock) {
#if HIPRT_DEVICE_CODE
  const bool taken = atomicCAS(lock, 0u, 1u) == 0u;
  __threadfence();
  return taken;
#else
  std::uint32_t free = 0;
  return __atomic_compare_exchange_n(lock, &free, 1u, false, __ATOMIC_ACQUIRE, __ATOMIC_RELAXED);
#endif
}

/// Orders writes for every thread of the device: earlier writes of this thread come before its later writes.
HIPRT_HD HIPRT_FORCE_INLINE void finish_writes() {
#if HIPRT_DEVICE_CODE
  __threadfence();
#else
  __atomic_thread_fence(__ATOMIC_RELEASE);
#endif
}

/// Orders reads: later reads of this thread see what other threads wrote before a value that load_shared() gave.
HIPRT_HD HIPRT_FORCE_INLINE void see_writes() {
#if HIPRT_DEVICE_CODE
  __threadfence();
#else
  __atomic_thread_fence(__ATOMIC_ACQUIRE);
#endif
}

/// Releases a lock that try_lock() took. The next holder can then read what this thread wrote.
HIPRT_HD HIPRT_FORCE_INLINE void unlock(std::uint32_t* lock) {
#if HIPRT_DEVICE_CODE
  __threadfence();
  atomicExch(lock, 0u);
#else
  __atomic_store_n(lock, 0u, __ATOMIC_RELEASE);
#endif
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
