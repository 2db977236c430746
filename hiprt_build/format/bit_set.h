#pragma once
/// A set of the numbers below a bound, one bit each, with rank. Host only.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace hiprt {

class BitSet {
 public:
  explicit BitSet(std::uint64_t bound) : words_(static_cast<std::size_t>((bound + 63) / 64)) {}

  bool test(std::uint64_t i) const { return (words_[static_cast<std::size_t>(i / 64)] >> (i % 64) & 1u) != 0; }

  /// @return whether i was in the set before.
  bool insert(std::uint64_t i) {
    std::uint64_t& word = words_[static_cast<std::size_t>(i / 64)];
    const std::uint64_t bit = std::uint64_t{1} << (i % 64);
    const bool before = (word & bit) != 0;
    word |= bit;
    return before;
  }

  std::uint64_t count() const {
    std::uint64_t sum = 0;
    for (const std::uint64_t word : words_) sum += static_cast<unsigned>(std::popcount(word));
    return sum;
  }

  /// @return the smallest number below @p bound that is not in the set, or @p bound.
  std::uint64_t first_absent(std::uint64_t bound) const {
    for (std::size_t w = 0; w < words_.size(); ++w) {
      const std::uint64_t i = w * 64 + static_cast<unsigned>(std::countr_one(words_[w]));
      if (words_[w] != ~std::uint64_t{0}) return i < bound ? i : bound;
    }
    return bound;
  }

  /// Prepares rank(); the set must not change afterwards.
  void index() {
    rank_.resize(words_.size());
    std::uint64_t sum = 0;
    for (std::size_t w = 0; w < words_.size(); ++w) {
      rank_[w] = sum;
      sum += static_cast<unsigned>(std::popcount(words_[w]));
    }
  }

  /// @return how many members are smaller than i. @pre index() was called.
  std::uint64_t rank(std::uint64_t i) const {
    const std::uint64_t below = (std::uint64_t{1} << (i % 64)) - 1;
    const std::size_t word = static_cast<std::size_t>(i / 64);
    return rank_[word] + static_cast<unsigned>(std::popcount(words_[word] & below));
  }

 private:
  std::vector<std::uint64_t> words_;
  std::vector<std::uint64_t> rank_;
};

}  // namespace hiprt
