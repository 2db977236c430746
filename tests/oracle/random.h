#pragma once
/// Random numbers for tests: a seed gives the same values on every machine and with every standard library.

#include <hiprt_build/input.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace hiprt::oracle {

/// SplitMix64 (Steele, Lea, Flood 2014).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits() {
    state_ += 0x9e3779b97f4a7c15u;
    std::uint64_t z = state_;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
  }
  /// @return an integer in [0, limit). @pre limit > 0.
  std::uint32_t below(std::uint32_t limit) { return static_cast<std::uint32_t>((bits() >> 32) * limit >> 32); }
  /// @return a double in [0, 1).
  double unit() { return std::ldexp(static_cast<double>(bits() >> 11), -53); }
  double uniform(double low, double high) { return low + (high - low) * unit(); }
  float uniform_float(double low, double high) { return static_cast<float>(uniform(low, high)); }
  /// @return a number whose logarithm is uniform between those of low and high. @pre 0 < low <= high.
  double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  bool coin() { return (bits() & 1u) != 0; }

  /// Uniform on the unit sphere.
  std::array<double, 3> on_sphere() {
    const double z = uniform(-1.0, 1.0), angle = uniform(0.0, 2.0 * std::numbers::pi);
    const double radius = std::sqrt(std::max(0.0, 1.0 - z * z));
    return {radius * std::cos(angle), radius * std::sin(angle), z};
  }
  /// Uniform in the cube [-extent, extent]^3.
  build::Position in_cube(double extent) {
    return {uniform_float(-extent, extent), uniform_float(-extent, extent), uniform_float(-extent, extent)};
  }
  /// Any float with random bits, NaN and infinity included.
  float any_float() { return std::bit_cast<float>(static_cast<std::uint32_t>(bits() >> 32)); }

 private:
  std::uint64_t state_;
};

}  // namespace hiprt::oracle
