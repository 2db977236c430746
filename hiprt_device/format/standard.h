#pragma once
/// The parts of the standard library that hiprt_device uses.
///
/// Run-time compilers (NVRTC, hipRTC) have no standard library. For them this header defines the same names in
/// namespace hiprt::std, where the code of hiprt finds them first. So a kernel that is compiled at run time writes
/// hiprt::closest_hit, not `using namespace hiprt`.

#if __cplusplus < 202002L
#error "hiprt needs C++20: compile with -std=c++20"
#include <hiprt needs C++20>  // Does not exist: compilers stop here, before hundreds of errors that follow from it.
#endif

// Files are traced as they lie in memory, so numbers have the file's byte order, and sizes and offsets have 64 bits.
#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "hiprt: this machine is big-endian, and BVH files are little-endian: FORMAT.md says how to read them"
#include <hiprt needs a little-endian machine>  // Does not exist.
#endif
#if defined(__SIZEOF_POINTER__) && __SIZEOF_POINTER__ < 8
#error "hiprt: this machine has 32-bit pointers, and BVH files have 64-bit offsets: compile for a 64-bit machine"
#include <hiprt needs a 64-bit machine>  // Does not exist.
#endif

#if defined(__CUDACC_RTC__) || defined(__HIPCC_RTC__)
#define HIPRT_RUN_TIME_COMPILER 1
#else
#define HIPRT_RUN_TIME_COMPILER 0
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>
#endif

#if HIPRT_RUN_TIME_COMPILER

namespace hiprt::std {

using size_t = decltype(sizeof(0));
using uint8_t = unsigned char;
using uint16_t = unsigned short;
using int32_t = int;
using uint32_t = unsigned;
using uint64_t = unsigned long long;
using uintptr_t = decltype(sizeof(0));
enum class byte : unsigned char {};
enum class endian { little, big, native = little };

template <bool kValue> struct bool_constant { static constexpr bool value = kValue; };
template <class T> struct type_identity { using type = T; };
template <class T> using type_identity_t = T;
template <bool kFirst, class A, class B> struct conditional { using type = A; };
template <class A, class B> struct conditional<false, A, B> { using type = B; };
template <bool kFirst, class A, class B> using conditional_t = typename conditional<kFirst, A, B>::type;
template <class A, class B> inline constexpr bool is_same_v = false;
template <class A> inline constexpr bool is_same_v<A, A> = true;
template <class T> inline constexpr bool is_empty_v = __is_empty(T);
template <class A, class B>
concept same_as = is_same_v<A, B> && is_same_v<B, A>;
template <class T> __host__ __device__ T&& declval() noexcept;
template <class From, class To>
concept convertible_to = requires(void (&take)(To), From (&give)()) {
  take(give());
};
template <class T, class... Arguments>
concept constructible_from = requires {
  T(declval<Arguments>()...);
};

template <size_t... kIndex> struct index_sequence {};
namespace sequence_detail {
template <size_t kCount, size_t... kIndex> struct Make : Make<kCount - 1, kCount - 1, kIndex...> {};
template <size_t... kIndex> struct Make<0, kIndex...> { using type = index_sequence<kIndex...>; };
}  // namespace sequence_detail
template <size_t kCount> using make_index_sequence = typename sequence_detail::Make<kCount>::type;

template <class To, class From> __host__ __device__ constexpr To bit_cast(const From& from) noexcept {
  static_assert(sizeof(To) == sizeof(From));
  return __builtin_bit_cast(To, from);
}
__device__ constexpr int countl_zero(uint32_t bits) noexcept {
  if (!__builtin_is_constant_evaluated()) return __clz(static_cast<int>(bits));
  int count = 0;
  for (uint32_t bit = 1u << 31; bit != 0 && (bits & bit) == 0; bit >>= 1) ++count;
  return count;
}
__device__ constexpr int bit_width(uint32_t bits) noexcept { return 32 - countl_zero(bits); }
__host__ __device__ inline void* memcpy(void* to, const void* from, size_t size) { return ::memcpy(to, from, size); }

template <class T> struct numeric_limits;
template <> struct numeric_limits<float> {
  __host__ __device__ static constexpr float min() { return 0x1p-126f; }
  __host__ __device__ static constexpr float max() { return 0x1.fffffep127f; }
  __host__ __device__ static constexpr float epsilon() { return 0x1p-23f; }
  __host__ __device__ static constexpr float infinity() { return __builtin_bit_cast(float, 0x7f800000u); }
  __host__ __device__ static constexpr float quiet_NaN() { return __builtin_bit_cast(float, 0x7fc00000u); }
};
template <> struct numeric_limits<double> {
  __host__ __device__ static constexpr double min() { return 0x1p-1022; }
  __host__ __device__ static constexpr double max() { return 0x1.fffffffffffffp1023; }
  __host__ __device__ static constexpr double epsilon() { return 0x1p-52; }
  __host__ __device__ static constexpr double infinity() { return __builtin_bit_cast(double, 0x7ff0000000000000ull); }
  __host__ __device__ static constexpr double quiet_NaN() { return __builtin_bit_cast(double, 0x7ff8000000000000ull); }
};

}  // namespace hiprt::std

#endif
