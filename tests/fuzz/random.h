#pragma once
/// Random numbers that break things.

#include <tests/oracle/random.h>

#include <iterator>
#include <limits>

namespace hiprt::fuzz {

class Random : public oracle::Random {
 public:
  using oracle::Random::Random;

  /// @pre limit in [1, 2^32).
  std::uint32_t below(std::uint64_t limit) { return oracle::Random::below(static_cast<std::uint32_t>(limit)); }

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
    if (coin()) return kEdges[below(std::size(kEdges))];
    const float any = any_float();
    return any - any == 0.0f ? any : 1.0f;
  }
};

}  // namespace hiprt::fuzz
