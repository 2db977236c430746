#pragma once
/// Random numbers of scenes: the same on every machine.

#include <cstdint>
#include <random>

namespace hiprt::bench {

/// Uses std::mt19937, whose bits the standard prescribes. Standard distributions differ between libraries.
class Random {
 public:
  explicit Random(std::uint32_t seed = std::mt19937::default_seed) : bits_(seed) {}

  double between(double low, double high) { return low + (high - low) * 0x1p-32 * static_cast<double>(bits_()); }
  /// 0 to count - 1.
  std::uint32_t below(std::uint32_t count) {
    return static_cast<std::uint32_t>(0x1p-32 * static_cast<double>(bits_()) * count);
  }

 private:
  std::mt19937 bits_;
};

}  // namespace hiprt::bench
