#pragma once
/// Gives vertices at the same position the same number. Internal.

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/input.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>

namespace hiprt::build {

/// Step: canonical[v] = number of a vertex whose position has the same bits, for the v of block i. Which one it is
/// depends on timing; whether two vertices share it does not. Open addressing in a table of a power of two of at least
/// 2 n slots, all kInvalidId; the slots of a block are fetched side by side.
struct WeldStep {
  static constexpr std::size_t kBlock = 16;
  static constexpr std::size_t kChunk = CpuEngine::kChunk / kBlock;

  StridedSpan<Position> positions;
  std::span<std::uint32_t> table;
  std::span<std::uint32_t> canonical;

  static std::size_t blocks(std::size_t vertices) { return (vertices + kBlock - 1) / kBlock; }

  void operator()(std::size_t i) const {
    const std::size_t begin = i * kBlock, end = std::min(begin + kBlock, positions.size());
    std::array<std::size_t, kBlock> slots;
    for (std::size_t v = begin; v < end; ++v) {
      slots[v - begin] = hash(positions[v]) & (table.size() - 1);
      __builtin_prefetch(&table[slots[v - begin]], 1);
    }
    for (std::size_t v = begin; v < end; ++v) canonical[v] = find(static_cast<std::uint32_t>(v), slots[v - begin]);
  }

  std::uint32_t find(std::uint32_t vertex, std::size_t slot) const {
    for (;; slot = (slot + 1) & (table.size() - 1)) {
      std::atomic_ref<std::uint32_t> entry(table[slot]);
      std::uint32_t there = entry.load(std::memory_order_relaxed);
      if (there == kInvalidId && entry.compare_exchange_strong(there, vertex)) return vertex;
      if (bits(positions[there]) == bits(positions[vertex])) return there;
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
