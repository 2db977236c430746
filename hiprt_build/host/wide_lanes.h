#pragma once
/// Eight floats at a time: the boxes of a HostNode, or two leaves of two triangles. Internal; for sources compiled with
/// AVX2 and FMA.
///
/// The operations are those of SimdLanes (lanes.h), with the same rounding per lane.

#include <hiprt_device/math/lanes.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Eight lanes in an AVX register. A half has four lanes.
struct WideLanes {
  using Scalar = float;
  using Float = __m256;
  static HIPRT_FORCE_INLINE float value(Float a) { return a[0]; }

  /// Eight floats. @param p multiple of 32 bytes.
  static HIPRT_FORCE_INLINE Float load(const float* p) { return _mm256_load_ps(p); }
  /// Four floats for the first half and four for the second. @param p, q multiples of 16 bytes.
  static HIPRT_FORCE_INLINE Float load_halves(const float* p, const float* q) {
    return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(p)), _mm_load_ps(q), 1);
  }
  /// @param p multiple of 32 bytes.
  static HIPRT_FORCE_INLINE void store(float* p, Float a) { _mm256_store_ps(p, a); }
  static HIPRT_FORCE_INLINE Float all(float a) { return _mm256_set1_ps(a); }
  static HIPRT_FORCE_INLINE Float add(Float a, Float b) { return a + b; }
  static HIPRT_FORCE_INLINE Float sub(Float a, Float b) { return a - b; }
  static HIPRT_FORCE_INLINE Float mul(Float a, Float b) { return a * b; }
  static HIPRT_FORCE_INLINE Float div(Float a, Float b) { return a / b; }
  static HIPRT_FORCE_INLINE Float min(Float a, Float b) { return _mm256_min_ps(a, b); }
  static HIPRT_FORCE_INLINE Float max(Float a, Float b) { return _mm256_max_ps(a, b); }
  static HIPRT_FORCE_INLINE Float magnitude(Float a) { return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), a); }
  static HIPRT_FORCE_INLINE Float flip_sign(Float a, Float sign) {
    return _mm256_xor_ps(a, _mm256_and_ps(sign, _mm256_set1_ps(-0.0f)));
  }
  static HIPRT_FORCE_INLINE Float fma(Float a, Float b, Float c) { return _mm256_fmadd_ps(a, b, c); }
  static HIPRT_FORCE_INLINE Float fnma(Float a, Float b, Float c) { return _mm256_fnmadd_ps(a, b, c); }
  static HIPRT_FORCE_INLINE Float fms(Float a, Float b, Float c) { return _mm256_fmsub_ps(a, b, c); }
  static HIPRT_FORCE_INLINE Float first_in(Float a, Float b, Float c, Float begin) {
    return as_floats(_mm256_max_epi32(_mm256_max_epi32(bits(a), bits(b)), _mm256_max_epi32(bits(c), bits(begin))));
  }
  static HIPRT_FORCE_INLINE Float last_in(Float a, Float b, Float c, Float end) {
    return as_floats(_mm256_min_epi32(_mm256_min_epi32(bits(a), bits(b)), _mm256_min_epi32(bits(c), bits(end))));
  }
  /// Bit per lane: a <= b, compared as bits. @pre no lane of a is negative, none of either is NaN
  static HIPRT_FORCE_INLINE std::uint32_t not_later(Float a, Float b) {
    return bits_of(as_floats(_mm256_cmpgt_epi32(bits(a), bits(b)))) ^ 0xffu;
  }
  static HIPRT_FORCE_INLINE std::uint32_t less_equal(Float a, Float b) {
    return bits_of(_mm256_cmp_ps(a, b, _CMP_LE_OQ));
  }
  /// In each half.
  template <int A, int B, int C, int D> static HIPRT_FORCE_INLINE Float shuffle(Float a) {
    return _mm256_shuffle_ps(a, a, A | B << 2 | C << 4 | D << 6);
  }
  static HIPRT_FORCE_INLINE std::uint32_t greater(Float a, Float b) { return bits_of(lanes_greater(a, b)); }
  /// The lanes with a > b: all of their bits are set.
  static HIPRT_FORCE_INLINE Float lanes_greater(Float a, Float b) { return _mm256_cmp_ps(a, b, _CMP_GT_OQ); }
  static HIPRT_FORCE_INLINE Float both(Float lanes, Float others) { return _mm256_and_ps(lanes, others); }
  static HIPRT_FORCE_INLINE Float either(Float lanes, Float others) { return _mm256_or_ps(lanes, others); }
  static HIPRT_FORCE_INLINE Float exclusive_or(Float a, Float b) { return _mm256_xor_ps(a, b); }
  /// Bit per lane: its sign.
  static HIPRT_FORCE_INLINE std::uint32_t bits_of(Float lanes) {
    return static_cast<std::uint32_t>(_mm256_movemask_ps(lanes));
  }
  static HIPRT_FORCE_INLINE Float all_bits(std::uint32_t a) {
    return as_floats(_mm256_set1_epi32(static_cast<int>(a)));
  }
  static HIPRT_FORCE_INLINE std::uint32_t bit(Float a, unsigned i) { return std::bit_cast<std::uint32_t>(get(a, i)); }
  static HIPRT_FORCE_INLINE void store_bits(std::uint32_t* p, Float a) {
    _mm256_store_si256(reinterpret_cast<__m256i*>(p), bits(a));
  }
  /// The lanes whose bits are set, for select().
  static HIPRT_FORCE_INLINE Float lanes_of(std::uint32_t mask) {
    const __m256i lane = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    return as_floats(_mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(static_cast<int>(mask)), lane), lane));
  }
  static HIPRT_FORCE_INLINE Float select(Float lanes, Float a, Float b) { return _mm256_blendv_ps(b, a, lanes); }
  static HIPRT_FORCE_INLINE float get(Float a, unsigned i) { return a[i]; }
  /// Lane @p kLane of four numbers.
  template <int kLane> static HIPRT_FORCE_INLINE Float spread(SimdLanes::Float of) {
    return _mm256_broadcastss_ps(SimdLanes::shuffle<kLane, kLane, kLane, kLane>(of));
  }

 private:
  static HIPRT_FORCE_INLINE __m256i bits(Float a) { return _mm256_castps_si256(a); }
  static HIPRT_FORCE_INLINE Float as_floats(__m256i a) { return _mm256_castsi256_ps(a); }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
