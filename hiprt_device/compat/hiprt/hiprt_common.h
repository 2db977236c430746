#pragma once
/// Macros, constants and small functions under HIPRT's names. C++17 suffices, so hosts need not compile as C++20.

#if defined(__CUDACC_RTC__) || defined(__HIPCC_RTC__)
#define __KERNELCC_RTC__  ///< A run-time compiler: NVRTC or hipRTC.
#endif
#if defined(__CUDACC__) || defined(__HIPCC__) || defined(__KERNELCC_RTC__)
#define __KERNELCC__  ///< A compiler of kernels, in both of its passes.
#endif

#if !defined(__KERNELCC_RTC__)
#if defined(__HIPCC__) && !defined(__CUDACC__)
#include <hip/hip_runtime.h>
#endif
#include <algorithm>
#include <cassert>
#include <cfloat>
#include <climits>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>
#else
// Run-time compilers have no <cstdint>.
typedef signed char int8_t;
typedef unsigned char uint8_t;
typedef short int16_t;
typedef unsigned short uint16_t;
typedef int int32_t;
typedef unsigned int uint32_t;
typedef long long int64_t;
typedef unsigned long long uint64_t;
#endif

#if !defined(__KERNELCC__)
// Programs of HIPRT write these also in files for plain C++ compilers.
#if !defined(__host__)
#define __host__
#endif
#if !defined(__device__)
#define __device__
#endif
#endif

#define HIPRT_HOST __host__
#define HIPRT_DEVICE __device__
#define HIPRT_HOST_DEVICE __host__ __device__
#define HIPRT_INLINE inline
#define HIPRT_CONST const
#define HIPRT_STATIC_ASSERT(condition) static_assert(condition, #condition)
#if defined(__KERNELCC__)
#define HIPRT_ASSERT(condition, message)
#else
#define HIPRT_ASSERT(condition, message) assert((condition) && (message))
#endif

#if !defined(HIPRT_RTIP)
#define HIPRT_RTIP 0  ///< 0: traversal in software.
#endif

namespace hiprt {

inline constexpr float Pi = 3.14159265358979f;
inline constexpr float TwoPi = 2.0f * Pi;
inline constexpr float FltMin = 1.175494351e-38f;
inline constexpr float FltMax = 3.402823466e+38f;
inline constexpr int IntMin = -2147483647 - 1;
inline constexpr int IntMax = 2147483647;
inline constexpr uint32_t InvalidValue = ~0u;
inline constexpr uint32_t FullRayMask = ~0u;
inline constexpr uint32_t MaxBatchBuildMaxPrimCount = 512u;
inline constexpr uint32_t MaxInstanceLevels = 4u;
inline constexpr uint32_t DefaultAlignment = 64u;
inline constexpr uint32_t InstanceIDBits = 24u;
inline constexpr uint32_t Rtip = HIPRT_RTIP;
inline constexpr uint32_t BranchingFactor = Rtip >= 31u ? 8u : 4u;
/// Lanes of a wave: 64 on AMD's gfx9, else 32.
#if defined(__GFX9__)
inline constexpr uint32_t WarpSize = 64u;
#else
inline constexpr uint32_t WarpSize = 32u;
#endif

/// As in the standard library, which run-time compilers do not have.
template <typename T, typename U> struct is_same { static constexpr bool value = false; };
template <typename T> struct is_same<T, T> { static constexpr bool value = true; };
template <bool First, typename T, typename U> struct conditional { using type = T; };
template <typename T, typename U> struct conditional<false, T, U> { using type = U; };

namespace compat_detail {

template <typename T> struct RemoveReference { using Type = T; };
template <typename T> struct RemoveReference<T&> { using Type = T; };
template <typename T> struct RemoveReference<T&&> { using Type = T; };

/// The same bits as another type.
template <typename To, typename From> HIPRT_HOST_DEVICE inline To bits_as(const From& from) {
  static_assert(sizeof(To) == sizeof(From), "the types differ in size");
  To to;
  ::memcpy(&to, &from, sizeof(To));
  return to;
}

}  // namespace compat_detail

/// As in the standard library.
template <typename T>
HIPRT_HOST_DEVICE constexpr typename compat_detail::RemoveReference<T>::Type&& move(T&& value) noexcept {
  return static_cast<typename compat_detail::RemoveReference<T>::Type&&>(value);
}
template <typename T>
HIPRT_HOST_DEVICE constexpr T&& forward(typename compat_detail::RemoveReference<T>::Type& value) noexcept {
  return static_cast<T&&>(value);
}
template <typename T>
HIPRT_HOST_DEVICE constexpr T&& forward(typename compat_detail::RemoveReference<T>::Type&& value) noexcept {
  return static_cast<T&&>(value);
}

/// The same bits as another type.
HIPRT_HOST_DEVICE inline float as_float(uint32_t value) { return compat_detail::bits_as<float>(value); }
HIPRT_HOST_DEVICE inline float as_float(int32_t value) { return compat_detail::bits_as<float>(value); }
HIPRT_HOST_DEVICE inline int32_t as_int(float value) { return compat_detail::bits_as<int32_t>(value); }
HIPRT_HOST_DEVICE inline int32_t as_int(uint32_t value) { return static_cast<int32_t>(value); }
HIPRT_HOST_DEVICE inline uint32_t as_uint(float value) { return compat_detail::bits_as<uint32_t>(value); }
HIPRT_HOST_DEVICE inline uint32_t as_uint(int32_t value) { return static_cast<uint32_t>(value); }

/// Number of zero bits above the highest one; 32 for 0.
HIPRT_HOST_DEVICE inline uint32_t clz(uint32_t value) {
#if defined(__HIP_DEVICE_COMPILE__) || defined(__CUDA_ARCH__)
  return static_cast<uint32_t>(__clz(static_cast<int>(value)));
#else
  return value == 0u ? 32u : static_cast<uint32_t>(__builtin_clz(value));
#endif
}
HIPRT_HOST_DEVICE inline uint32_t clz(int32_t value) { return clz(static_cast<uint32_t>(value)); }

/// ceil(value / divisor).
template <typename T> HIPRT_HOST_DEVICE constexpr T DivideRoundUp(T value, T divisor) {
  return (value + divisor - 1) / divisor;
}
/// The next multiple of a number.
template <typename T> HIPRT_HOST_DEVICE constexpr T RoundUp(T value, T multiple) {
  return DivideRoundUp(value, multiple) * multiple;
}
/// The largest n with 2^n <= value.
HIPRT_HOST_DEVICE constexpr uint32_t Log2(uint32_t value) { return value <= 1u ? 0u : 1u + Log2(value / 2u); }

#if defined(__KERNELCC__)
#if defined(__CUDACC__)
/// The value of another lane of the wave. All lanes of the wave call it.
template <typename T> HIPRT_DEVICE inline T shfl(T value, int lane) { return __shfl_sync(~0u, value, lane); }
template <typename T> HIPRT_DEVICE inline T shfl_up(T value, uint32_t distance) {
  return __shfl_up_sync(~0u, value, distance);
}
template <typename T> HIPRT_DEVICE inline T shfl_down(T value, uint32_t distance) {
  return __shfl_down_sync(~0u, value, distance);
}
template <typename T> HIPRT_DEVICE inline T shfl_xor(T value, int mask) { return __shfl_xor_sync(~0u, value, mask); }
/// A bit per active lane for which the condition holds, and whether it holds for any and for all of them.
HIPRT_DEVICE inline uint64_t ballot(int condition) { return __ballot_sync(__activemask(), condition); }
HIPRT_DEVICE inline bool any(int condition) { return __any_sync(__activemask(), condition) != 0; }
HIPRT_DEVICE inline bool all(int condition) { return __all_sync(__activemask(), condition) != 0; }
#else
/// The value of another lane of the wave. All lanes of the wave call it.
template <typename T> HIPRT_DEVICE inline T shfl(T value, int lane) { return __shfl(value, lane); }
template <typename T> HIPRT_DEVICE inline T shfl_up(T value, uint32_t distance) { return __shfl_up(value, distance); }
template <typename T> HIPRT_DEVICE inline T shfl_down(T value, uint32_t distance) {
  return __shfl_down(value, distance);
}
template <typename T> HIPRT_DEVICE inline T shfl_xor(T value, int mask) { return __shfl_xor(value, mask); }
/// A bit per active lane for which the condition holds, and whether it holds for any and for all of them.
HIPRT_DEVICE inline uint64_t ballot(int condition) { return __ballot(condition); }
HIPRT_DEVICE inline bool any(int condition) { return __any(condition) != 0; }
HIPRT_DEVICE inline bool all(int condition) { return __all(condition) != 0; }
#endif
#endif

}  // namespace hiprt
