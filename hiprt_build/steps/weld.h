#pragma once
/// Gives vertices at the same position the same number. Internal.

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/input.h>

#include <array>
#include <atomic>
#include <bit>

namespace hiprt::build {

/// Step: canonical[i] = number of a vertex whose position has the same bits. Which one it is depends on timing; whether
/// two vertices share it does not. Open addressing in a table of a power of two of at least 2 n slots, all kInvalidId.
struct WeldStep {
  std::span<const Position> positions;
  std::span<std::uint32_t> table;
  std::span<std::uint32_t> canonical;

  void operator()(std::size_t i) const {
    const std::size_t mask = table.size() - 1;
    for (std::size_t slot = hash(positions[i]) & mask;; slot = (slot + 1) & mask) {
      std::atomic_ref<std::uint32_t> entry(table[slot]);
      std::uint32_t there = entry.load(std::memory_order_relaxed);
      if (there == kInvalidId && entry.compare_exchange_strong(there, static_cast<std::uint32_t>(i)))
        there = static_cast<std::uint32_t>(i);
      if (bits(positions[there]) == bits(positions[i])) {
        canonical[i] = there;
        return;
      }
    }
  }

  using Bits = std::array<std::uint32_t, 3>;
  static Bits bits(const Position& p) { return std::bit_cast<Bits>(p); }

  static std::size_t hash(const Position& p) {
    std::uint64_t h = 0;
    for (const std::uint32_t x : bits(p)) {
      h = (h ^ x) * 0x9e3779b97f4a7c15u;
      h ^= h >> 29;
    }
    return static_cast<std::size_t>(h ^ h >> 32);
  }
};

}  // namespace hiprt::build
