#pragma once
/// Four floats at a time: the types in which box and triangle tests are written.
///
/// `ArrayLanes` is plain C++ for every compiler and the device. `SimdLanes` uses the host's vector registers. Both
/// give the same bits, because every operation is a single IEEE rounding per lane.

#include <hiprt_device/format/half.h>
#include <hiprt_device/math/memory.h>
#include <hiprt_device/math/scalar.h>

// A kernel's policies must have the same names in the host's and in the GPU's pass over a source.
#if defined(__SSE2__) && !HIPRT_GPU_COMPILER
#define HIPRT_SIMD_LANES 1
// The header of all instruction sets is slow to compile. It is included only for AVX or FMA.
#if defined(__AVX__)
#include <immintrin.h>
#else
#include <emmintrin.h>
#endif
#else
#define HIPRT_SIMD_LANES 0
#endif
#if HIPRT_SIMD_LANES && defined(__AVX2__) && defined(__FMA__)
#define HIPRT_AVX2_LANES 1
#else
#define HIPRT_AVX2_LANES 0
#endif

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The value of a half, from its bits; exact.
HIPRT_HD HIPRT_FORCE_INLINE float widen_half(std::uint32_t bits) {
#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__)
  return static_cast<float>(std::bit_cast<_Float16>(static_cast<std::uint16_t>(bits)));
#elif HIPRT_DEVICE_CODE
  float value;
  asm("cvt.f32.f16 %0, %1;" : "=f"(value) : "h"(static_cast<std::uint16_t>(bits)));
  return value;
#else
  return half_to_float(static_cast<std::uint16_t>(bits));
#endif
}

/// The largest of three numbers, none NaN. If all are negative (-0 counts), the result is the lowest of those.
///
/// The bits of floats that are not negative have the order of integers. Negative floats are negative integers, and the
/// lowest float is the largest of them.
HIPRT_HD HIPRT_FORCE_INLINE float largest_by_bits(float a, float b, float c) {
  const auto later = [](std::int32_t x, std::int32_t y) HIPRT_FORCE_INLINE_LAMBDA { return x > y ? x : y; };
  const auto bits = [](float x) HIPRT_FORCE_INLINE_LAMBDA { return std::bit_cast<std::int32_t>(x); };
  return std::bit_cast<float>(later(later(bits(a), bits(b)), bits(c)));
}
/// The smallest of three numbers, none NaN. If some are negative (-0 counts), the result is the highest of those.
HIPRT_HD HIPRT_FORCE_INLINE float smallest_by_bits(float a, float b, float c) {
  const auto sooner = [](std::int32_t x, std::int32_t y) HIPRT_FORCE_INLINE_LAMBDA { return x < y ? x : y; };
  const auto bits = [](float x) HIPRT_FORCE_INLINE_LAMBDA { return std::bit_cast<std::int32_t>(x); };
  return std::bit_cast<float>(sooner(sooner(bits(a), bits(b)), bits(c)));
}

/// Four lanes in an array; loops over lanes are unrolled by the compiler.
/// @tparam Real float; double for the triangle tests of double rays, which load floats too.
template <class Real> struct BasicArrayLanes {
  /// See BitLanes.
  static constexpr bool kComparesBits = false;
  /// Choices between lanes need no branches, and arrays no varying indices: for registers of GPUs.
  static constexpr bool kScalar = true;
  using Scalar = Real;
  struct Float {
    Real lane[4];
  };
  /// A value that is the same in all lanes.
  using Uniform = Real;
  HIPRT_HD static HIPRT_FORCE_INLINE Uniform uniform(Real a) { return a; }
  HIPRT_HD static HIPRT_FORCE_INLINE Real value(Uniform a) { return a; }

  /// @param p multiple of 16 bytes, in the scene.
  HIPRT_HD static HIPRT_FORCE_INLINE Float load(const float* p) {
    const Words words = load_words(p);
    return {{words.as_float(0), words.as_float(1), words.as_float(2), words.as_float(3)}};
  }
  HIPRT_HD static HIPRT_FORCE_INLINE void store(Real* p, const Float& a) {
    for (int i = 0; i < 4; ++i) p[i] = a.lane[i];
  }
  HIPRT_HD static HIPRT_FORCE_INLINE Float set(Real a, Real b, Real c, Real d) { return {{a, b, c, d}}; }
  HIPRT_HD static HIPRT_FORCE_INLINE Float all(Real a) { return {{a, a, a, a}}; }
  /// From the low 16 bits of each argument.
  HIPRT_HD static HIPRT_FORCE_INLINE Float from_halves(std::uint32_t a, std::uint32_t b, std::uint32_t c,
                                                       std::uint32_t d) {
    return {{widen_half(a), widen_half(b), widen_half(c), widen_half(d)}};
  }
  /// Lane i is byte i, 0 to 255, plus kByteBias. NVIDIA's instruction for sums of products of bytes puts the byte into
  /// the significand of 65536. It runs beside comparisons and selections, which limit coherent rays.
  HIPRT_HD static HIPRT_FORCE_INLINE Float from_bytes(std::uint32_t bytes) {
#if HIPRT_DEVICE_CODE && !defined(__HIP_DEVICE_COMPILE__)
    // A unit of 65536's significand is 2^-7. So byte * 2^7 + the bits of 65536 are the bits of 65536 + byte.
    return map([&](int i) HIPRT_FORCE_INLINE_LAMBDA {
      return std::bit_cast<float>(__dp4a(bytes, 128u << (8 * i), 0x47800000u));
    });
#else
    return map([&](int i) HIPRT_FORCE_INLINE_LAMBDA { return static_cast<float>(bytes >> (8 * i) & 0xffu); });
#endif
  }
#if HIPRT_DEVICE_CODE && !defined(__HIP_DEVICE_COMPILE__)
  static constexpr float kByteBias = 65536.0f;
#else
  static constexpr float kByteBias = 0.0f;
#endif
  template <class Operation> HIPRT_HD static HIPRT_FORCE_INLINE Float map(Operation operation) {
    return {{operation(0), operation(1), operation(2), operation(3)}};
  }
  HIPRT_HD static HIPRT_FORCE_INLINE Float add(const Float& a, const Float& b) {
    return map([&](int i) { return a.lane[i] + b.lane[i]; });
  }
  HIPRT_HD static HIPRT_FORCE_INLINE Float sub(const Float& a, const Float& b) {
    return map([&](int i) { return a.lane[i] - b.lane[i]; });
  }
  HIPRT_HD static HIPRT_FORCE_INLINE Float sub(const Float& a, Uniform b) {
    return map([&](int i) { return a.lane[i] - b; });
  }
  HIPRT_HD static HIPRT_FORCE_INLINE Float mul(const Float& a, const Float& b) {
    return map([&](int i) { return a.lane[i] * b.lane[i]; });
  }
  HIPRT_HD static HIPRT_FORCE_INLINE Float div(const Float& a, const Float& b) {
    return map([&](int i) { return a.lane[i] / b.lane[i]; });
  }
  /// Correctly rounded a * b + c.
  HIPRT_HD static HIPRT_FORCE_INLINE Float fma(const Float& a, const Float& b, const Float& c) {
    return map([&](int i) { return fused_multiply_add(a.lane[i], b.lane[i], c.lane[i]); });
  }
  /// Correctly rounded c - a * b.
  HIPRT_HD static HIPRT_FORCE_INLINE Float fnma(const Float& a, const Float& b, const Float& c) {
    return map([&](int i) { return fused_multiply_add(-a.lane[i], b.lane[i], c.lane[i]); });
  }
  HIPRT_HD static HIPRT_FORCE_INLINE Float fnma(Uniform a, const Float& b, const Float& c) {
    return map([&](int i) { return fused_multiply_add(-a, b.lane[i], c.lane[i]); });
  }
  /// a * b - c, correctly rounded.
  HIPRT_HD static HIPRT_FORCE_INLINE Float fms(const Float& a, const Float& b, const Float& c) {
    return map([&](int i) { return fused_multiply_add(a.lane[i], b.lane[i], -c.lane[i]); });
  }
  /// a * b + c with one rounding or two.
  HIPRT_HD static HIPRT_FORCE_INLINE Float madd(const Float& a, const Float& b, const Float& c) {
    return map([&](int i) { return multiply_add(a.lane[i], b.lane[i], c.lane[i]); });
  }
  HIPRT_HD static HIPRT_FORCE_INLINE Float madd(const Float& a, Uniform b, Uniform c) {
    return map([&](int i) { return multiply_add(a.lane[i], b, c); });
  }
  HIPRT_HD static HIPRT_FORCE_INLINE Float min(const Float& a, const Float& b) {
    return map([&](int i) HIPRT_FORCE_INLINE_LAMBDA { return smaller(a.lane[i], b.lane[i]); });
  }
  HIPRT_HD static HIPRT_FORCE_INLINE Float max(const Float& a, const Float& b) {
    return map([&](int i) HIPRT_FORCE_INLINE_LAMBDA { return larger(a.lane[i], b.lane[i]); });
  }
  HIPRT_HD static HIPRT_FORCE_INLINE Float min(const Float& a, Uniform b) {
    return map([&](int i) HIPRT_FORCE_INLINE_LAMBDA { return smaller(a.lane[i], b); });
  }
  HIPRT_HD static HIPRT_FORCE_INLINE Float max(const Float& a, Uniform b) {
    return map([&](int i) HIPRT_FORCE_INLINE_LAMBDA { return larger(a.lane[i], b); });
  }
  /// Where a ray has entered all of three slabs and begins (first_in()), and where it leaves one of them or ends
  /// (last_in()).
  ///
  /// begin and end are 0 or more, and begin is not -0. first_in() <= last_in() has the result for exact maxima and
  /// minima. There is one exception, on Hopper and with SSE 4.1: if the ray leaves at -0 exactly, it may be true. An
  /// end of -0 must not be compared by bits: it would be below every other number, so the ray would meet all boxes
  /// behind it.
  HIPRT_HD static HIPRT_FORCE_INLINE Float first_in(const Float& a, const Float& b, const Float& c, Uniform begin) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
    // Hopper has an instruction for the largest of three integers.
    return map([&](int i) HIPRT_FORCE_INLINE_LAMBDA {
      return largest_by_bits(largest_by_bits(a.lane[i], b.lane[i], c.lane[i]), begin, begin);
    });
#else
    return max(max(a, b), max(c, begin));
#endif
  }
  HIPRT_HD static HIPRT_FORCE_INLINE Float last_in(const Float& a, const Float& b, const Float& c, Uniform end) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
    return map([&](int i) HIPRT_FORCE_INLINE_LAMBDA {
      return smaller(smallest_by_bits(a.lane[i], b.lane[i], c.lane[i]), end);
    });
#else
    return min(min(a, b), min(c, end));
#endif
  }
  HIPRT_HD static HIPRT_FORCE_INLINE Float magnitude(const Float& a) {
    return map([&](int i) HIPRT_FORCE_INLINE_LAMBDA { return without_sign(a.lane[i]); });
  }
  /// The largest lane. A NaN does not hide other lanes: devices skip it, hosts treat it as infinity.
  HIPRT_HD static HIPRT_FORCE_INLINE Real largest(const Float& a) {
#if HIPRT_DEVICE_CODE
    return larger(larger(a.lane[0], a.lane[1]), larger(a.lane[2], a.lane[3]));
#else
    const auto at = [&](int i) { return smaller(a.lane[i], std::numeric_limits<float>::infinity()); };
    return larger(larger(at(0), at(1)), larger(at(2), at(3)));
#endif
  }
  template <int A, int B, int C, int D> HIPRT_HD static HIPRT_FORCE_INLINE Float shuffle(const Float& a) {
    return {{a.lane[A], a.lane[B], a.lane[C], a.lane[D]}};
  }
  /// Lane i is x[i] if a[i] < b[i], else y[i].
  HIPRT_HD static HIPRT_FORCE_INLINE Float if_less(const Float& a, const Float& b, const Float& x, const Float& y) {
    return map([&](int i) HIPRT_FORCE_INLINE_LAMBDA { return a.lane[i] < b.lane[i] ? +x.lane[i] : +y.lane[i]; });
  }
  /// Bit i: a[i] > b[i] (false for NaN).
  HIPRT_HD static HIPRT_FORCE_INLINE std::uint32_t greater(const Float& a, const Float& b) {
    return bits([&](int i) { return a.lane[i] > b.lane[i]; });
  }
  /// Bit i: a[i] <= b[i] (false for NaN).
  HIPRT_HD static HIPRT_FORCE_INLINE std::uint32_t less_equal(const Float& a, const Float& b) {
    return bits([&](int i) { return a.lane[i] <= b.lane[i]; });
  }
  HIPRT_HD static HIPRT_FORCE_INLINE Real get(const Float& a, unsigned i) { return a.lane[i]; }

 private:
  template <class Predicate> HIPRT_HD static HIPRT_FORCE_INLINE std::uint32_t bits(Predicate predicate) {
    std::uint32_t result = 0;
    for (int i = 0; i < 4; ++i) result |= predicate(i) ? 1u << i : 0u;
    return result;
  }
};

/// For any machine.
using ArrayLanes = BasicArrayLanes<float>;

/// For boxes whose distances are compared by their bits. Then distances are counted from where the ray begins
/// (BoxHits::by_bits()).
struct BitLanes : ArrayLanes {
  static constexpr bool kComparesBits = true;
  /// Where a ray has entered all of three slabs, and where it leaves one of them.
  HIPRT_HD static HIPRT_FORCE_INLINE Float first_by_bits(const Float& a, const Float& b, const Float& c) {
    return map([&](int i) HIPRT_FORCE_INLINE_LAMBDA { return largest_by_bits(a.lane[i], b.lane[i], c.lane[i]); });
  }
  HIPRT_HD static HIPRT_FORCE_INLINE Float last_by_bits(const Float& a, const Float& b, const Float& c) {
    return map([&](int i) HIPRT_FORCE_INLINE_LAMBDA { return smallest_by_bits(a.lane[i], b.lane[i], c.lane[i]); });
  }
};

/// The lanes for boxes of scenes without instances. Hopper has instructions for the largest and the smallest of three
/// integers. With instances they give 0.97 to 1.01 of the speed (H200): entering one takes longer.
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
template <class Lanes> using FlatLanes = std::conditional_t<std::is_same_v<Lanes, ArrayLanes>, BitLanes, Lanes>;
#else
template <class Lanes> using FlatLanes = Lanes;
#endif
/// For the triangle test of double rays.
using DoubleLanes = BasicArrayLanes<double>;

#if HIPRT_SIMD_LANES

/// Four lanes in an SSE register (the compilers' vector type of 16 bytes).
struct SimdLanes {
  static constexpr bool kScalar = false;
  static constexpr bool kComparesBits = false;
  using Scalar = float;
  static constexpr float kByteBias = 0.0f;
  using Float = __m128;
  using Uniform = __m128;
  static HIPRT_FORCE_INLINE Uniform uniform(float a) { return _mm_set1_ps(a); }
  static HIPRT_FORCE_INLINE float value(Uniform a) { return a[0]; }

  static HIPRT_FORCE_INLINE Float load(const float* p) { return _mm_loadu_ps(p); }
  static HIPRT_FORCE_INLINE void store(float* p, Float a) { _mm_storeu_ps(p, a); }
  static HIPRT_FORCE_INLINE Float set(float a, float b, float c, float d) { return _mm_setr_ps(a, b, c, d); }
  static HIPRT_FORCE_INLINE Float all(float a) { return _mm_set1_ps(a); }
  static HIPRT_FORCE_INLINE Float from_halves(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    return set(widen_half(a), widen_half(b), widen_half(c), widen_half(d));
  }
  static HIPRT_FORCE_INLINE Float from_bytes(std::uint32_t bytes) {
    const __m128i zero = _mm_setzero_si128();
    const __m128i shorts = _mm_unpacklo_epi8(_mm_cvtsi32_si128(static_cast<int>(bytes)), zero);
    return _mm_cvtepi32_ps(_mm_unpacklo_epi16(shorts, zero));
  }
  static HIPRT_FORCE_INLINE Float add(Float a, Float b) { return a + b; }
  static HIPRT_FORCE_INLINE Float sub(Float a, Float b) { return a - b; }
  static HIPRT_FORCE_INLINE Float mul(Float a, Float b) { return a * b; }
  static HIPRT_FORCE_INLINE Float div(Float a, Float b) { return a / b; }
#if defined(__FMA__)
  static HIPRT_FORCE_INLINE Float fma(Float a, Float b, Float c) { return _mm_fmadd_ps(a, b, c); }
  static HIPRT_FORCE_INLINE Float fnma(Float a, Float b, Float c) { return _mm_fnmadd_ps(a, b, c); }
  static HIPRT_FORCE_INLINE Float fms(Float a, Float b, Float c) { return _mm_fmsub_ps(a, b, c); }
  static HIPRT_FORCE_INLINE Float madd(Float a, Float b, Float c) { return _mm_fmadd_ps(a, b, c); }
#else
  static HIPRT_FORCE_INLINE Float fma(Float a, Float b, Float c) {
    return set(__builtin_fmaf(a[0], b[0], c[0]), __builtin_fmaf(a[1], b[1], c[1]), __builtin_fmaf(a[2], b[2], c[2]),
               __builtin_fmaf(a[3], b[3], c[3]));
  }
  static HIPRT_FORCE_INLINE Float fnma(Float a, Float b, Float c) { return fma(-a, b, c); }
  static HIPRT_FORCE_INLINE Float fms(Float a, Float b, Float c) { return fma(a, b, -c); }
  static HIPRT_FORCE_INLINE Float madd(Float a, Float b, Float c) { return a * b + c; }
#endif
  static HIPRT_FORCE_INLINE Float min(Float a, Float b) { return _mm_min_ps(a, b); }
  static HIPRT_FORCE_INLINE Float max(Float a, Float b) { return _mm_max_ps(a, b); }
#if defined(__SSE4_1__)
  // By bits: an integer comparison takes one cycle, that of floats four.
  static HIPRT_FORCE_INLINE Float first_in(Float a, Float b, Float c, Uniform begin) {
    const __m128i larger = _mm_max_epi32(_mm_castps_si128(a), _mm_castps_si128(b));
    return _mm_castsi128_ps(_mm_max_epi32(larger, _mm_max_epi32(_mm_castps_si128(c), _mm_castps_si128(begin))));
  }
  static HIPRT_FORCE_INLINE Float last_in(Float a, Float b, Float c, Uniform end) {
    const __m128i smaller = _mm_min_epi32(_mm_castps_si128(a), _mm_castps_si128(b));
    return _mm_min_ps(_mm_castsi128_ps(_mm_min_epi32(smaller, _mm_castps_si128(c))), end);
  }
#else
  static HIPRT_FORCE_INLINE Float first_in(Float a, Float b, Float c, Uniform begin) {
    return max(max(a, b), max(c, begin));
  }
  static HIPRT_FORCE_INLINE Float last_in(Float a, Float b, Float c, Uniform end) {
    return min(min(a, b), min(c, end));
  }
#endif
  static HIPRT_FORCE_INLINE Float magnitude(Float a) { return _mm_andnot_ps(_mm_set1_ps(-0.0f), a); }
  /// Lane i is a[i], with the other sign where sign[i] is negative (-0 counts).
  static HIPRT_FORCE_INLINE Float flip_sign(Float a, Float sign) {
    return _mm_xor_ps(a, _mm_and_ps(sign, _mm_set1_ps(-0.0f)));
  }
  /// Lane @p kLane of four numbers.
  template <int kLane> static HIPRT_FORCE_INLINE Uniform spread(Float of) {
    return shuffle<kLane, kLane, kLane, kLane>(of);
  }
  static HIPRT_FORCE_INLINE float largest(Float a) {
    const Float no_nan = _mm_min_ps(a, _mm_set1_ps(std::numeric_limits<float>::infinity()));
    const Float two = _mm_max_ps(no_nan, _mm_movehl_ps(no_nan, no_nan));
    return _mm_cvtss_f32(_mm_max_ss(two, shuffle<1, 1, 1, 1>(two)));
  }
  template <int A, int B, int C, int D> static HIPRT_FORCE_INLINE Float shuffle(Float a) {
    return _mm_shuffle_ps(a, a, A | B << 2 | C << 4 | D << 6);
  }
  static HIPRT_FORCE_INLINE Float if_less(Float a, Float b, Float x, Float y) {
    const Float less = _mm_cmplt_ps(a, b);
    return _mm_or_ps(_mm_and_ps(less, x), _mm_andnot_ps(less, y));
  }
  static HIPRT_FORCE_INLINE std::uint32_t greater(Float a, Float b) {
    return static_cast<std::uint32_t>(_mm_movemask_ps(_mm_cmpgt_ps(a, b)));
  }
  static HIPRT_FORCE_INLINE std::uint32_t less_equal(Float a, Float b) {
    return static_cast<std::uint32_t>(_mm_movemask_ps(_mm_cmple_ps(a, b)));
  }
  static HIPRT_FORCE_INLINE float get(Float a, unsigned i) { return a[i]; }
};

/// The fastest lanes on this machine. The hits are the same with all lanes.
using DefaultLanes = SimdLanes;
#else
using DefaultLanes = ArrayLanes;
#endif

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
