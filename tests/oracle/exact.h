#pragma once
/// Exact arithmetic on floats for the tests. Every finite float is an integer multiple of 2^-149. So polynomials of
/// floats are integers after scaling, and quotients are rationals (GMP).

#include <gmpxx.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace hiprt::oracle {

using Integer = mpz_class;
using Rational = mpq_class;
using Integer3 = std::array<Integer, 3>;

/// Power of two that makes every finite float an integer.
inline constexpr int kFloatScale = 149;

/// @return value * 2^149. @pre finite.
inline Integer scaled(float value) { return Integer(std::ldexp(static_cast<double>(value), kFloatScale)); }

/// @return the float as a rational. @pre finite.
inline Rational exact(float value) { return Rational(static_cast<double>(value)); }

/// @return numerator / denominator in lowest terms. @pre denominator != 0.
inline Rational quotient(const Integer& numerator, const Integer& denominator) {
  Rational result(numerator, denominator);
  result.canonicalize();
  return result;
}

inline Integer3 difference(const Integer3& a, const Integer3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

inline Integer3 cross(const Integer3& a, const Integer3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline Integer dot(const Integer3& a, const Integer3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// @return the float nearest to value, ties to even, +-infinity beyond the range (IEEE 754 round to nearest).
inline float nearest_float(const Rational& value) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  // The first value that rounds to infinity: half a unit above the largest float.
  static const Rational overflow = Rational(std::ldexp(1.0, 128)) - Rational(std::ldexp(1.0, 103));
  if (value >= overflow) return kInfinity;
  if (value <= -overflow) return -kInfinity;
  const auto start = static_cast<float>(value.get_d());
  const float middle = std::isfinite(start) ? start : std::copysign(std::numeric_limits<float>::max(), start);
  float best = middle;
  Rational best_error = abs(exact(best) - value);
  for (const float other : {std::nextafter(middle, -kInfinity), std::nextafter(middle, kInfinity)}) {
    if (!std::isfinite(other)) continue;
    const Rational error = abs(exact(other) - value);
    const bool even = (std::bit_cast<std::uint32_t>(other) & 1u) == 0;
    if (error < best_error || (error == best_error && even)) best = other, best_error = error;
  }
  return best;
}

/// Spacing of the floats at a magnitude: 2^(exponent - 23), at least 2^-149.
inline double ulp(double magnitude) {
  if (magnitude == 0.0) return std::ldexp(1.0, -kFloatScale);
  return std::ldexp(1.0, std::max(std::ilogb(magnitude) - 23, -kFloatScale));
}

/// @return |value - exact|, rounded to double at the end only. @pre value finite.
inline double absolute_error(float value, const Rational& truth) {
  const Rational error = abs(exact(value) - truth);
  return error.get_d();
}

/// @return |value - exact| in units of the float spacing at @p magnitude (by default at the exact value).
inline double error_in_ulps(float value, const Rational& truth, double magnitude) {
  return absolute_error(value, truth) / ulp(magnitude);
}
inline double error_in_ulps(float value, const Rational& truth) {
  return error_in_ulps(value, truth, std::abs(truth.get_d()));
}

}  // namespace hiprt::oracle
