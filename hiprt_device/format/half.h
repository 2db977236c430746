#pragma once
/// 16-bit floats (IEEE 754 binary16) in integer arithmetic: exact widening, and narrowing to the neighbour on a chosen
/// side. Subnormal halves are ordinary numbers. The result is the same on every machine.

#include <hiprt_device/format/portability.h>

namespace hiprt {

/// Bits of +inf and -inf.
inline constexpr std::uint16_t kHalfInfinity = 0x7c00;
inline constexpr std::uint16_t kHalfNegativeInfinity = 0xfc00;

namespace half_detail {

/// Bits of the float with the value of a half without its sign. @param half below 0x8000.
HIPRT_HD HIPRT_FORCE_INLINE constexpr std::uint32_t widen_magnitude(std::uint32_t half) {
  const std::uint32_t exponent = half >> 10, fraction = half & 0x3ffu;
  if (exponent == 31) return 0x7f800000u | fraction << 13;
  if (exponent != 0) return (exponent + 112) << 23 | fraction << 13;
  if (fraction == 0) return 0;
  // Subnormal: fraction * 2^-24. Its leading one becomes the float's implicit bit.
  const std::uint32_t lead = 31u - static_cast<std::uint32_t>(std::countl_zero(fraction));
  return (lead + 103) << 23 | (fraction << (23 - lead) & 0x7fffffu);
}

/// The float with these bits, rounded towards zero to a half. It is finite unless the float is infinite.
/// @param bits at most 0x7f800000.
HIPRT_HD HIPRT_FORCE_INLINE constexpr std::uint32_t truncate_magnitude(std::uint32_t bits) {
  constexpr std::uint32_t kInfinity = 0x7f800000u, kTooLarge = 0x47800000u, kNormal = 0x38800000u, kTiny = 0x33800000u;
  if (bits >= kInfinity) return kHalfInfinity;
  if (bits >= kTooLarge) return kHalfInfinity - 1u;
  if (bits >= kNormal) return (bits - 0x38000000u) >> 13;
  if (bits < kTiny) return 0;
  return ((bits & 0x7fffffu) | 0x800000u) >> (126u - (bits >> 23));
}

}  // namespace half_detail

/// The value of a half; exact. NaN stays NaN.
HIPRT_HD HIPRT_FORCE_INLINE constexpr float half_to_float(std::uint16_t half) {
  const std::uint32_t sign = static_cast<std::uint32_t>(half & 0x8000u) << 16;
  return std::bit_cast<float>(sign | half_detail::widen_magnitude(half & 0x7fffu));
}

/// The largest half that is not above @p value; -infinity below -65504. +infinity and NaN stay the same.
HIPRT_HD HIPRT_FORCE_INLINE constexpr std::uint16_t half_below(float value) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(value), magnitude = bits & 0x7fffffffu;
  if (magnitude > 0x7f800000u) return 0x7e00;
  const std::uint32_t half = half_detail::truncate_magnitude(magnitude);
  if ((bits & 0x80000000u) == 0) return static_cast<std::uint16_t>(half);
  const std::uint32_t away = half_detail::widen_magnitude(half) == magnitude ? half : half + 1;
  return static_cast<std::uint16_t>(0x8000u | away);
}

/// The smallest half that is not below @p value; +infinity above 65504. -infinity and NaN stay the same.
HIPRT_HD HIPRT_FORCE_INLINE constexpr std::uint16_t half_above(float value) {
  const float negative = std::bit_cast<float>(std::bit_cast<std::uint32_t>(value) ^ 0x80000000u);
  return static_cast<std::uint16_t>(half_below(negative) ^ 0x8000u);
}

}  // namespace hiprt
