#pragma once
/// Well-spread pseudo-random points that depend on nothing but pixel, sample number and seed.

#include <hiprt_device/format/portability.h>

#include <array>
#include <cstdint>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

namespace sampler_detail {

HIPRT_HD inline std::uint32_t reverse_bits(std::uint32_t v) {
  v = (v >> 16) | (v << 16);
  v = ((v & 0x00ff00ffu) << 8) | ((v >> 8) & 0x00ff00ffu);
  v = ((v & 0x0f0f0f0fu) << 4) | ((v >> 4) & 0x0f0f0f0fu);
  v = ((v & 0x33333333u) << 2) | ((v >> 2) & 0x33333333u);
  return ((v & 0x55555555u) << 1) | ((v >> 1) & 0x55555555u);
}

/// A bijection of 32-bit words with good avalanche (the finaliser of MurmurHash3).
HIPRT_HD inline std::uint32_t mix(std::uint32_t v) {
  v = (v ^ (v >> 16)) * 0x85ebca6bu;
  v = (v ^ (v >> 13)) * 0xc2b2ae35u;
  return v ^ (v >> 16);
}

/// Owen's nested uniform scramble, through the hash of Laine and Karras, "Stratified sampling for stochastic
/// transparency" (2011), whose carries only run upwards, on reversed bits.
HIPRT_HD inline std::uint32_t owen_scramble(std::uint32_t v, std::uint32_t seed) {
  v = reverse_bits(v) + seed;
  v ^= v * 0x6c50b47cu;
  v ^= v * 0xb82f1e52u;
  v ^= v * 0xc7afe638u;
  v ^= v * 0x8d22f6e6u;
  return reverse_bits(v);
}

/// Second dimension of Sobol's sequence; the first is reverse_bits().
HIPRT_HD inline std::uint32_t sobol_second(std::uint32_t index) {
  std::uint32_t result = 0;
  for (std::uint32_t direction = 0x80000000u; index != 0; index >>= 1, direction ^= direction >> 1)
    if ((index & 1u) != 0) result ^= direction;
  return result;
}

/// The upper 24 bits as a number in [0, 1).
HIPRT_HD inline float to_unit(std::uint32_t v) { return static_cast<float>(v >> 8) * 0x1p-24f; }

}  // namespace sampler_detail

/// What a sample is used for; sets of different use are independent.
enum class SampleUse : std::uint32_t {
  kPixel = 1,
  kDirection = 2,
  kTime = 3,
  kBounce = 16  ///< Bounce b of a path uses this + 4 b and the three after it.
};

/// The points of one pixel: Owen-scrambled and shuffled Sobol' points (Burley, "Practical hash-based Owen scrambling",
/// JCGT 2020). Every power of two of them is stratified.
class PixelSampler {
 public:
  HIPRT_HD PixelSampler(std::uint32_t x, std::uint32_t y, std::uint32_t seed)
      : hash_(sampler_detail::mix(x ^ sampler_detail::mix(y ^ sampler_detail::mix(seed)))) {}

  /// @return a point of [0, 1)^2.
  HIPRT_HD std::array<float, 2> point(std::uint32_t sample, SampleUse use) const {
    using namespace sampler_detail;
    const std::uint32_t seed = mix(hash_ ^ (static_cast<std::uint32_t>(use) * 0x9e3779b9u));
    const std::uint32_t index = owen_scramble(sample, seed);
    return {to_unit(owen_scramble(reverse_bits(index), mix(seed + 1))),
            to_unit(owen_scramble(sobol_second(index), mix(seed + 2)))};
  }

 private:
  std::uint32_t hash_;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
