#pragma once
/// Arithmetic that rounds the same whether or not a compiler contracts operations.

#include <hiprt_device/format/portability.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Correctly rounded a * b + c.
HIPRT_HD HIPRT_FORCE_INLINE float fused_multiply_add(float a, float b, float c) {
#if HIPRT_DEVICE_CODE
  return fmaf(a, b, c);
#else
  return __builtin_fmaf(a, b, c);
#endif
}

HIPRT_HD HIPRT_FORCE_INLINE double fused_multiply_add(double a, double b, double c) {
#if HIPRT_DEVICE_CODE
  return ::fma(a, b, c);
#else
  return __builtin_fma(a, b, c);
#endif
}

/// |a| by the processor's instruction, which is a sign modifier on GPUs.
HIPRT_HD HIPRT_FORCE_INLINE float without_sign(float a) {
#if HIPRT_DEVICE_CODE
  return fabsf(a);
#else
  return __builtin_fabsf(a);
#endif
}
HIPRT_HD HIPRT_FORCE_INLINE double without_sign(double a) {
#if HIPRT_DEVICE_CODE
  return ::fabs(a);
#else
  return __builtin_fabs(a);
#endif
}

/// The correctly rounded square root. Devices call the library's function: on AMD clang's builtin is the bare
/// instruction, which is not correctly rounded.
HIPRT_HD HIPRT_FORCE_INLINE double square_root(double a) {
#if HIPRT_DEVICE_CODE
  return ::sqrt(a);
#else
  return __builtin_sqrt(a);
#endif
}

/// The number of the lowest bit that is set. In device code nvcc 13 takes libstdc++'s std::countr_zero() as the
/// constant 32, without a warning.
/// @pre bits != 0
HIPRT_HD HIPRT_FORCE_INLINE unsigned lowest_bit(std::uint32_t bits) {
#if HIPRT_DEVICE_CODE
  return static_cast<unsigned>(__ffs(static_cast<int>(bits))) - 1u;
#else
  return static_cast<unsigned>(__builtin_ctz(bits));
#endif
}

/// Correctly rounded a / b, also under nvcc's --use_fast_math.
HIPRT_HD HIPRT_FORCE_INLINE float divided(float a, float b) {
#if HIPRT_DEVICE_CODE && !defined(__HIP_DEVICE_COMPILE__)
  return __fdiv_rn(a, b);
#else
  return a / b;
#endif
}
HIPRT_HD HIPRT_FORCE_INLINE double divided(double a, double b) { return a / b; }

/// The nearest float, for numbers that are used in double again.
///
/// A cast is not enough. g++ 12 (from -O2 on) drops the rounding when it vectorises conversions to float and back, two
/// at a time.
/// @param nearest a value that the compiler may know to come from a double.
HIPRT_HD HIPRT_FORCE_INLINE float nearest_float(float nearest) {
#if !HIPRT_DEVICE_CODE && defined(__GNUC__) && !defined(__clang__)
#if defined(__SSE2__)
  asm("" : "+x"(nearest));
#else
  asm("" : "+m"(nearest));
#endif
#endif
  return nearest;
}
HIPRT_HD HIPRT_FORCE_INLINE float nearest_float(double x) { return nearest_float(static_cast<float>(x)); }

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
