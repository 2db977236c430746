#pragma once
/// Macros with which one source compiles as plain C++, as HIP (hipcc) and as CUDA (nvcc).
///
/// Nothing else in hiprt_device tests the compiler, except lanes.h (vector registers of the host) and vec.h (GLM).

#include <hiprt_device/format/standard.h>

// The preprocessor cannot see nvcc's --use_fast_math. The guarantees hold under it: they rest on operations that it
// does not change (arithmetic.h), and subnormal numbers may be flushed.
#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ != 0) || \
    defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__)
#define HIPRT_FAST_MATH 1
#else
#define HIPRT_FAST_MATH 0
#endif
#if HIPRT_FAST_MATH && !defined(HIPRT_ALLOW_FAST_MATH)
// The guarantees that break: no ray passes between neighbours, no hit is behind a box that is missed, NaN is never hit.
#error "hiprt: a part of -ffast-math breaks the guarantees: compile without it, or define HIPRT_ALLOW_FAST_MATH"
#endif

#if defined(__MINGW32__) && !defined(__FMA__)
// MinGW-w64's own fma() does not round as IEEE 754 says, and the error bounds rest on it.
#error "hiprt: MinGW's fma() is not exact: compile with -mfma or -march=x86-64-v3"
#endif

#if defined(__HIPCC__) || defined(__CUDACC__) || HIPRT_RUN_TIME_COMPILER
#if defined(__HIPCC__) && !defined(__CUDACC__) && !HIPRT_RUN_TIME_COMPILER
#include <hip/hip_runtime.h>
#endif
/// Marks a function that runs on the host and on the device.
#define HIPRT_HD __host__ __device__
#else
#define HIPRT_HD
#endif

/// 1 in both passes of a GPU compiler over a source.
#if defined(__HIPCC__) || defined(__CUDACC__) || HIPRT_RUN_TIME_COMPILER
#define HIPRT_GPU_COMPILER 1
#else
#define HIPRT_GPU_COMPILER 0
#endif

/// 1 while the compiler generates device code, 0 while it generates host code.
#if defined(__HIP_DEVICE_COMPILE__) || defined(__CUDA_ARCH__)
#define HIPRT_DEVICE_CODE 1
#else
#define HIPRT_DEVICE_CODE 0
#endif

/// HIPRT_FORCE_INLINE_LAMBDA comes after a lambda's parameters. With HIPRT_LEAVE_INLINING the compiler decides what to
/// inline. Sanitized code then compiles several times as fast.
#if defined(HIPRT_LEAVE_INLINING)
#define HIPRT_FORCE_INLINE inline
#define HIPRT_FORCE_INLINE_LAMBDA
#elif defined(__CUDACC__) && !defined(__clang__)
#define HIPRT_FORCE_INLINE __forceinline__
#define HIPRT_FORCE_INLINE_LAMBDA
#elif defined(__GNUC__) || defined(__clang__)
#define HIPRT_FORCE_INLINE inline __attribute__((always_inline))
#define HIPRT_FORCE_INLINE_LAMBDA __attribute__((always_inline))
#else
#define HIPRT_FORCE_INLINE inline
#define HIPRT_FORCE_INLINE_LAMBDA
#endif

/// For code that only some rays reach and that needs many registers. As a part of the same function, NVIDIA's compiler
/// would spill data that every ray uses. On AMD GPUs the effect was not measured.
#if defined(__CUDACC__) && !defined(__clang__)
#define HIPRT_OUTLINE __noinline__ inline
#else
#define HIPRT_OUTLINE HIPRT_FORCE_INLINE
#endif

/// For large code that runs rarely, such as arithmetic in double: one copy of it in each kernel keeps kernels small.
#if defined(__CUDACC__) || defined(__HIPCC__)
#define HIPRT_COLD __attribute__((noinline)) inline
#else
#define HIPRT_COLD inline
#endif

/// Stands before a template with HIPRT_HD that calls host functions when it is instantiated for hosts. nvcc would
/// refuse it.
#if defined(__CUDACC__) && !defined(__clang__)
#define HIPRT_MAY_CALL_HOST _Pragma("nv_exec_check_disable")
#else
#define HIPRT_MAY_CALL_HOST
#endif

/// Stands before a rarely executed loop whose code must stay small.
#if defined(__CUDA_ARCH__) || defined(__clang__)
#define HIPRT_NO_UNROLL _Pragma("unroll 1")
#elif defined(__GNUC__) && !defined(__CUDACC__)
#define HIPRT_NO_UNROLL _Pragma("GCC unroll 1")
#else
#define HIPRT_NO_UNROLL
#endif

/// Stands before a short loop over an array that must need few registers on NVIDIA's GPUs. AMD's compiler moves arrays
/// to memory unless all indices are known, so there it is unrolled.
#if defined(__CUDA_ARCH__)
#define HIPRT_NO_UNROLL_ON_NVIDIA _Pragma("unroll 1")
#elif defined(__HIP_DEVICE_COMPILE__)
#define HIPRT_NO_UNROLL_ON_NVIDIA _Pragma("unroll")
#else
#define HIPRT_NO_UNROLL_ON_NVIDIA
#endif

/// The name of the inline namespace for this instruction set.
///
/// A program may contain the same functions compiled for several x86-64 levels and choose at run time. The inline
/// namespace keeps their symbols apart, so the linker never gives AVX2 code to a machine without it. The name is isa_
/// and a digit each for SSE4.2, AVX, AVX2, FMA, BMI2, AVX-512 F and AVX-512 VL: x86-64-v3 is isa_1111100. Under
/// fast-math with HIPRT_ALLOW_FAST_MATH it ends in _fast_math, so that code without guarantees replaces no code with
/// guarantees. GPU compilers use isa_gpu in both passes; otherwise a kernel would have two names.
#if defined(__SSE4_2__)
#define HIPRT_ISA_SSE4_2 1
#else
#define HIPRT_ISA_SSE4_2 0
#endif
#if defined(__AVX__)
#define HIPRT_ISA_AVX 1
#else
#define HIPRT_ISA_AVX 0
#endif
#if defined(__AVX2__)
#define HIPRT_ISA_AVX2 1
#else
#define HIPRT_ISA_AVX2 0
#endif
#if defined(__FMA__)
#define HIPRT_ISA_FMA 1
#else
#define HIPRT_ISA_FMA 0
#endif
#if defined(__BMI2__)
#define HIPRT_ISA_BMI2 1
#else
#define HIPRT_ISA_BMI2 0
#endif
#if defined(__AVX512F__)
#define HIPRT_ISA_AVX512F 1
#else
#define HIPRT_ISA_AVX512F 0
#endif
#if defined(__AVX512VL__)
#define HIPRT_ISA_AVX512VL 1
#else
#define HIPRT_ISA_AVX512VL 0
#endif
#if HIPRT_FAST_MATH
#define HIPRT_ISA_JOIN_EXPANDED(a, b, c, d, e, f, g) isa_##a##b##c##d##e##f##g##_fast_math
#else
#define HIPRT_ISA_JOIN_EXPANDED(a, b, c, d, e, f, g) isa_##a##b##c##d##e##f##g
#endif
#define HIPRT_ISA_JOIN(a, b, c, d, e, f, g) HIPRT_ISA_JOIN_EXPANDED(a, b, c, d, e, f, g)
#if HIPRT_GPU_COMPILER
#define HIPRT_ISA_NAMESPACE isa_gpu
#else
#define HIPRT_ISA_NAMESPACE                                                                                         \
  HIPRT_ISA_JOIN(HIPRT_ISA_SSE4_2, HIPRT_ISA_AVX, HIPRT_ISA_AVX2, HIPRT_ISA_FMA, HIPRT_ISA_BMI2, HIPRT_ISA_AVX512F, \
                 HIPRT_ISA_AVX512VL)
#endif
