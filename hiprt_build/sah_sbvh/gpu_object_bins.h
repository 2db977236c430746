#pragma once
/// Bins of references in memory that many threads share, and the best split of references between them. All numbers in
/// bins are integers that threads lower, raise or add to: the result does not depend on their order. Internal.

#include <hiprt_build/sah_sbvh/gpu_lane_boxes.h>
#include <hiprt_build/sah_sbvh/sah_bins.h>

namespace hiprt::build::kernels {

/// A box as integers that order as its numbers do.
inline __device__ void to_ordered(const Box& box, std::uint32_t (&low)[3], std::uint32_t (&high)[3]) {
  for (unsigned k = 0; k < 3; ++k) {
    low[k] = to_ordered(box.min[k]);
    high[k] = to_ordered(box.max[k]);
  }
}

/// Words of a box of ordered integers, lows first, and of counts behind it: [axis][word][bin].
template <unsigned kBinCount, unsigned kCountWords> struct BinWords {
  static constexpr unsigned kBins = kBinCount, kWords = 6 + kCountWords, kSize = 3 * kWords * kBins;

  std::uint32_t* words;

  __device__ std::uint32_t* at(unsigned axis, unsigned word, unsigned bin) const {
    return words + (axis * kWords + word) * kBins + bin;
  }
  __device__ static constexpr unsigned word_of(unsigned i) { return i / kBins % kWords; }
  __device__ static constexpr std::uint32_t empty(unsigned i) { return word_of(i) < 3 ? 0xffffffffu : 0u; }

  /// Part @p thread of @p threads.
  __device__ void clear(unsigned thread, unsigned threads) const {
    for (unsigned i = thread; i < kSize; i += threads) words[i] = empty(i);
  }
  /// Most boxes change nothing: their neighbours were there before. A look is cheaper than an atomic operation.
  __device__ void add(unsigned axis, unsigned bin, unsigned rotation, const std::uint32_t (&low)[3],
                      const std::uint32_t (&high)[3]) const {
    for (unsigned k = 0; k < 3; ++k) {
      const unsigned to = k + rotation < 3 ? k + rotation : k + rotation - 3;
      grow_word(at(axis, to, bin), low[k], true);
      grow_word(at(axis, 3 + to, bin), high[k], false);
    }
  }
  __device__ void count(unsigned axis, unsigned word, unsigned bin) const { fetch_add(at(axis, 6 + word, bin), 1); }
  /// Adds all of another's, part @p thread of @p threads.
  __device__ void add(const BinWords& other, unsigned thread, unsigned threads) const {
    for (unsigned i = thread; i < kSize; i += threads) {
      const std::uint32_t value = other.words[i];
      if (value == empty(i)) continue;
      if (word_of(i) >= 6)
        fetch_add(words + i, value);
      else
        grow_word(words + i, value, word_of(i) < 3);
    }
  }
  __device__ Box box(unsigned axis, unsigned bin) const { return box_of(at(axis, 0, 0), bin); }
  /// @param row at(axis, 0, 0)
  __device__ static Box box_of(const std::uint32_t* row, unsigned bin) {
    Box result = empty_box();
    if (row[bin] == 0xffffffffu) return result;
    for (unsigned k = 0; k < 3; ++k) {
      result.min[k] = from_ordered(row[k * kBins + bin]);
      result.max[k] = from_ordered(row[(3 + k) * kBins + bin]);
    }
    return result;
  }

 private:
  __device__ static void grow_word(std::uint32_t* word, std::uint32_t value, bool is_low) {
    const std::uint32_t there = load_shared(word);
    if (is_low) {
      if (value < there) hiprt::lower(word, value);
    } else if (value > there) {
      raise(word, value);
    }
  }
};
using ObjectBins = BinWords<kMaxBins, 1>;

/// As many bins as lanes, however wave_range references there are.
inline __device__ BinMapping lane_mapping(const Box& centers) {
  return BinMapping(to_simd(centers), std::size_t{16} * kMaxBins);
}

inline __device__ void bin_object(const ObjectBins& bins, const BinMapping& mapping, const Box& box) {
  const std::array<int, 3> bin = mapping(to_simd(box));
  std::uint32_t low[3], high[3];
  to_ordered(box, low, high);
#pragma unroll
  for (unsigned axis = 0; axis < 3; ++axis) {
    bins.add(axis, static_cast<unsigned>(bin[axis]), 0, low, high);
    bins.count(axis, 0, static_cast<unsigned>(bin[axis]));
  }
}

/// The best split of references between bins; the same in all lanes.
struct ObjectSplit {
  static constexpr std::uint32_t kNoAxis = 3;

  float cost;
  std::uint32_t axis;           ///< kNoAxis: there is none.
  std::uint32_t bin;            ///< First bin of the right side.
  float overlap;                ///< Half area of what both sides have in common.
  std::uint32_t left;           ///< References on the left side.
  float left_area, right_area;  ///< Half the areas of the boxes of the sides.
};

/// As find_best_split(), across axes [first, last). Lane i has the split before bin i. @param all the range's box.
inline __device__ ObjectSplit best_object_split(const WaveGroup& group, const ObjectBins& bins, const Box& all,
                                                unsigned first = 0, unsigned last = 3) {
  const unsigned lane = group.lane();
  LaneChoice best(SimdBox::kInfinity, 0);
  float overlap = 0.0f, left_area = 0.0f, right_area = 0.0f;
  std::uint32_t count_of_best = 0;
#pragma unroll 1
  for (unsigned axis = first; axis < last; ++axis) {
    Box right = bins.box(axis, lane), left = lane > 0 ? bins.box(axis, lane - 1) : empty_box();
    const std::uint32_t count = *bins.at(axis, 6, lane), up_to = sum_up(group, count), total = group.from(31, up_to);
    const std::uint32_t left_count = up_to - count, right_count = total - left_count;
    sum_up(group, left, 0, 5);
    sum_down(group, right, WaveGroup::kLanes, 5);
    const float cost = side_cost(left, left_count) + side_cost(right, right_count);
    const LaneChoice mine(left_count == 0 || right_count == 0 ? SimdBox::kInfinity : cost, axis << 5 | lane);
    if (mine.cost < best.cost) {
      best = mine;
      overlap = overlap_area(left, right);
      count_of_best = left_count;
      left_area = half_area(left);
      right_area = half_area(right);
    }
  }
  best = best_of_lanes(group, best);
  const unsigned from = best.tie & 31u;
  if (!best.exists()) return {SimdBox::kInfinity, ObjectSplit::kNoAxis, 0, half_area(all), 0, 0.0f, 0.0f};
  return {best.value(),
          best.tie >> 5,
          from,
          from_lane(group, from, overlap),
          group.from(from, count_of_best),
          from_lane(group, from, left_area),
          from_lane(group, from, right_area)};
}

}  // namespace hiprt::build::kernels
