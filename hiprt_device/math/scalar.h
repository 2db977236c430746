#pragma once
/// Small functions of one to four numbers.

#include <hiprt_device/math/arithmetic.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// a * b + c with one rounding or two, whichever is faster: for results whose error bound allows both.
HIPRT_HD HIPRT_FORCE_INLINE float multiply_add(float a, float b, float c) {
#if HIPRT_DEVICE_CODE || defined(__FMA__)
  return fused_multiply_add(a, b, c);
#else
  return a * b + c;
#endif
}

/// One instruction each. Of a NaN and a number, devices take the number and hosts take b.
HIPRT_HD HIPRT_FORCE_INLINE float smaller(float a, float b) {
#if HIPRT_DEVICE_CODE
  return fminf(a, b);
#else
  return a < b ? a : b;
#endif
}
HIPRT_HD HIPRT_FORCE_INLINE float larger(float a, float b) {
#if HIPRT_DEVICE_CODE
  return fmaxf(a, b);
#else
  return a > b ? a : b;
#endif
}

/// |a|, and the larger of two numbers. For NaN see larger().
HIPRT_HD HIPRT_FORCE_INLINE float absolute(float a) {
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(a) << 1 >> 1);
}
HIPRT_HD HIPRT_FORCE_INLINE double absolute(double a) {
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(a) << 1 >> 1);
}
HIPRT_HD HIPRT_FORCE_INLINE float max_of(float a, float b) { return larger(a, b); }
HIPRT_HD HIPRT_FORCE_INLINE double max_of(double a, double b) { return a > b ? a : b; }

/// a * d - b * c within 2 units of 2^-53, with the same bits on every machine (Kahan; Jeannerod, Louvet, Muller 2013).
HIPRT_HD HIPRT_FORCE_INLINE double difference_of_products(double a, double d, double b, double c) {
  const double product = b * c;
  return fused_multiply_add(a, d, -product) + fused_multiply_add(-b, c, product);
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
