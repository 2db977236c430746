#pragma once
/// Sorting by integer keys on the CPU: least significant digit first, chunks of the input side by side. Internal.

#include <hiprt_build/exec/cpu.h>

#include <array>
#include <utility>
#include <vector>

namespace hiprt::build {

/// See radix_sort().
class RadixSort {
 public:
  static constexpr unsigned kDigitBits = 8;
  static constexpr std::size_t kDigits = std::size_t{1} << kDigitBits;
  static constexpr std::size_t kChunk = 65536;

  RadixSort(CpuEngine& engine, std::span<std::uint64_t> keys, std::span<std::uint32_t> values)
      : engine_(engine),
        keys_(keys),
        values_(values),
        spare_keys_(engine.allocate<std::uint64_t>(keys.size())),
        spare_values_(engine.allocate<std::uint32_t>(keys.size())),
        counts_((keys.size() + kChunk - 1) / kChunk) {}

  void run(unsigned bits) {
    std::span<std::uint64_t> from_keys = keys_, to_keys = spare_keys_.span();
    std::span<std::uint32_t> from_values = values_, to_values = spare_values_.span();
    for (unsigned shift = 0; shift < bits; shift += kDigitBits) {
      if (!count(from_keys, shift)) continue;
      scatter(from_keys, from_values, to_keys, to_values, shift);
      std::swap(from_keys, to_keys);
      std::swap(from_values, to_values);
    }
    if (from_keys.data() == keys_.data()) return;
    engine_.copy(std::span<const std::uint64_t>(from_keys), keys_);
    engine_.copy(std::span<const std::uint32_t>(from_values), values_);
  }

 private:
  static std::size_t digit(std::uint64_t key, unsigned shift) { return key >> shift & (kDigits - 1); }

  template <class Body> void for_chunks(const Body& body) { engine_.for_quiet_chunks(keys_.size(), body, kChunk); }

  /// Where each chunk's keys with each digit go. @return false: all have the same digit, nothing is to be done.
  bool count(std::span<const std::uint64_t> keys, unsigned shift) {
    for_chunks([&](std::size_t chunk, std::size_t begin, std::size_t end) {
      counts_[chunk].fill(0);
      for (std::size_t i = begin; i < end; ++i) ++counts_[chunk][digit(keys[i], shift)];
    });
    std::size_t sum = 0;
    for (std::size_t d = 0; d < kDigits; ++d) {
      const std::size_t before = sum;
      for (auto& count : counts_) sum += std::exchange(count[d], sum);
      if (sum - before == keys.size()) return false;
    }
    return true;
  }

  void scatter(std::span<const std::uint64_t> keys, std::span<const std::uint32_t> values,
               std::span<std::uint64_t> to_keys, std::span<std::uint32_t> to_values, unsigned shift) {
    for_chunks([&](std::size_t chunk, std::size_t begin, std::size_t end) {
      auto& next = counts_[chunk];
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t to = next[digit(keys[i], shift)]++;
        to_keys[to] = keys[i];
        to_values[to] = values[i];
      }
    });
  }

  CpuEngine& engine_;
  std::span<std::uint64_t> keys_;
  std::span<std::uint32_t> values_;
  ScratchArray<std::uint64_t> spare_keys_;
  ScratchArray<std::uint32_t> spare_values_;
  std::vector<std::array<std::size_t, kDigits>> counts_;
};

/// Sorts pairs by key, equal keys in the order in which they come.
/// @param bits of the keys that may be set, from the lowest on.
inline void radix_sort(CpuEngine& engine, std::span<std::uint64_t> keys, std::span<std::uint32_t> values,
                       unsigned bits) {
  RadixSort sort(engine, keys, values);
  sort.run(bits);
}

}  // namespace hiprt::build
