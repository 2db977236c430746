#pragma once
/// A small random generator (splitmix64, Steele et al. 2014) and the numbers that break things.

#include <bit>
#include <cstdint>
#include <iterator>
#include <limits>

namespace hiprt::fuzz {

class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t next() {
    state_ += 0x9e3779b97f4a7c15u;
    std::uint64_t z = state_;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
  }
  /// @param bound not 0.
  std::uint64_t below(std::uint64_t bound) { return next() % bound; }
  /// In [0, 1).
  float unit() { return static_cast<float>(next() >> 40) * 0x1p-24f; }

  /// Any finite bit pattern, or a number at an edge of the range.
  float wild() {
    constexpr float kEdges[] = {0.0f,
                                -0.0f,
                                1.0f,
                                -1.0f,
                                0x1p-149f,
                                -0x1p-149f,
                                0x1p-126f,
                                0x1p60f,
                                -0x1p60f,
                                0x1p100f,
                                std::numeric_limits<float>::max(),
                                -std::numeric_limits<float>::max()};
    if (below(2) == 0) return kEdges[below(std::size(kEdges))];
    const float any = std::bit_cast<float>(static_cast<std::uint32_t>(next()));
    return any - any == 0.0f ? any : 1.0f;
  }

 private:
  std::uint64_t state_;
};

}  // namespace hiprt::fuzz
