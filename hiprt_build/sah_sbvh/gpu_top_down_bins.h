#pragma once
/// Bins of references in memory that many threads share, and the best splits of them, found by a group of lanes. All
/// numbers in bins are integers that are lowered, raised or added to: in no order, with one result. Internal.

#include <hiprt_build/exec/gpu_scan.h>
#include <hiprt_build/input/geometry.h>
#include <hiprt_build/pipeline/gpu_state.h>
#include <hiprt_build/sah_sbvh/sah_bins.h>
#include <hiprt_build/sah_sbvh/spatial_bins.h>

namespace hiprt::build::kernels {

/// A reference by two loads of 16 bytes, whatever becomes of its parts.
inline __device__ Reference load(const Reference* from) {
  const uint4 a = reinterpret_cast<const uint4*>(from)[0], b = reinterpret_cast<const uint4*>(from)[1];
  const auto number = [](std::uint32_t bits) { return std::bit_cast<float>(bits); };
  return Reference{
      {{number(a.x), number(a.y), number(a.z)}, {number(a.w), number(b.x), number(b.y)}}, LeafContents{b.z}, b.w};
}

// Boxes among lanes ---------------------------------------------------------------------------------------------------

inline __device__ float from_lane(const WaveGroup& group, unsigned lane, float value) {
  return std::bit_cast<float>(group.from(lane, std::bit_cast<std::uint32_t>(value)));
}
inline __device__ Box from_lane(const WaveGroup& group, unsigned lane, const Box& box) {
  Box result;
  for (unsigned k = 0; k < 3; ++k) {
    result.min[k] = from_lane(group, lane, box.min[k]);
    result.max[k] = from_lane(group, lane, box.max[k]);
  }
  return result;
}
/// grow() in fewer instructions. @pre no NaN.
inline __device__ void grow_fast(Box& box, const Box& other) {
  for (unsigned k = 0; k < 3; ++k) {
    box.min[k] = fminf(box.min[k], other.min[k]);
    box.max[k] = fmaxf(box.max[k], other.max[k]);
  }
}
/// The sum of all lanes' boxes.
inline __device__ Box unite_lanes(const WaveGroup& group, Box box) {
  for (unsigned step = 1; step < WaveGroup::kLanes; step *= 2)
    grow_fast(box, from_lane(group, group.lane() ^ step, box));
  return box;
}
/// The sum over this lane and those before it, down to @p first, of up to 1 << steps lanes.
inline __device__ void sum_up(const WaveGroup& group, Box& box, unsigned first, unsigned steps) {
  for (unsigned k = 0; k < steps; ++k) {
    const unsigned distance = 1u << k;
    const bool inside = group.lane() >= first + distance;
    const Box other = from_lane(group, inside ? group.lane() - distance : group.lane(), box);
    if (inside) grow_fast(box, other);
  }
}
/// The same over this lane and those behind it, as far as before @p last.
inline __device__ void sum_down(const WaveGroup& group, Box& box, unsigned last, unsigned steps) {
  for (unsigned k = 0; k < steps; ++k) {
    const unsigned distance = 1u << k;
    const bool inside = group.lane() + distance < last;
    const Box other = from_lane(group, inside ? group.lane() + distance : group.lane(), box);
    if (inside) grow_fast(box, other);
  }
}
inline __device__ std::uint32_t sum_down(const WaveGroup& group, std::uint32_t value, unsigned last) {
  for (unsigned distance = 1; distance < last; distance *= 2) {
    const bool inside = group.lane() + distance < last;
    const std::uint32_t other = group.from(inside ? group.lane() + distance : group.lane(), value);
    value += inside ? other : 0;
  }
  return value;
}

inline __device__ bool holds_nothing(const Box& box) { return !(box.min[0] <= box.max[0]); }
inline __device__ float side_cost(const Box& box, std::uint32_t count) {
  return holds_nothing(box) ? 0.0f : half_area(box) * static_cast<float>(count);
}
/// Half the area of what two boxes have in common.
inline __device__ float overlap_area(const Box& a, const Box& b) {
  float edge[3];
  bool common = true;
  for (unsigned k = 0; k < 3; ++k) {
    edge[k] = fminf(a.max[k], b.max[k]) - fmaxf(a.min[k], b.min[k]);
    common = common && edge[k] >= 0.0f;
  }
  return common ? half_area(edge[0], edge[1], edge[2]) : 0.0f;
}
/// Component @p axis, without an array in memory.
inline __device__ float pick(const float (&v)[3], unsigned axis) { return axis == 0 ? v[0] : axis == 1 ? v[1] : v[2]; }

/// The lane with the lowest cost; of two with the same the one with the lower tie.
struct LaneChoice {
  std::uint32_t cost;  ///< A float's bits; kNone: no lane has a finite one.
  std::uint32_t tie;

  static constexpr std::uint32_t kNone = 0xffffffffu;

  __device__ LaneChoice(float value, std::uint32_t tie_)
      : cost(value < SimdBox::kInfinity ? std::bit_cast<std::uint32_t>(value) : kNone), tie(tie_) {}
  __device__ void add(const LaneChoice& other, bool valid) {
    const bool better = valid && (other.cost < cost || (other.cost == cost && other.tie < tie));
    cost = better ? other.cost : cost;
    tie = better ? other.tie : tie;
  }
  __device__ LaneChoice from(const WaveGroup& group, unsigned lane) const {
    LaneChoice result = *this;
    result.cost = group.from(lane, cost);
    result.tie = group.from(lane, tie);
    return result;
  }
  __device__ bool exists() const { return cost != kNone; }
  __device__ float value() const { return exists() ? std::bit_cast<float>(cost) : SimdBox::kInfinity; }
};
inline __device__ LaneChoice best_of_lanes(const WaveGroup& group, LaneChoice mine) {
  for (unsigned step = 1; step < WaveGroup::kLanes; step *= 2) mine.add(mine.from(group, group.lane() ^ step), true);
  return mine;
}

// Bins ----------------------------------------------------------------------------------------------------------------

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
  __device__ Box box(unsigned axis, unsigned bin) const {
    Box result = empty_box();
    if (*at(axis, 0, bin) == 0xffffffffu) return result;
    for (unsigned k = 0; k < 3; ++k) {
      result.min[k] = from_ordered(*at(axis, k, bin));
      result.max[k] = from_ordered(*at(axis, 3 + k, bin));
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
using SlabBins = BinWords<kSpatialBins, 2>;  ///< References that begin there, and those that end.

/// As many bins as lanes, however few references there are.
inline __device__ BinMapping lane_mapping(const Box& centers) {
  return BinMapping(to_simd(centers), std::size_t{16} * kMaxBins);
}

inline __device__ void bin_object(const ObjectBins& bins, const BinMapping& mapping, const Box& box) {
  const std::array<int, 3> bin = mapping(to_simd(box));
  std::uint32_t low[3], high[3];
  for (unsigned k = 0; k < 3; ++k) {
    low[k] = to_ordered(box.min[k]);
    high[k] = to_ordered(box.max[k]);
  }
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
  std::uint32_t axis;  ///< kNoAxis: there is none.
  std::uint32_t bin;   ///< First bin of the right side.
  float overlap;       ///< Half area of what both sides have in common.
  std::uint32_t left;  ///< References on the left side.
};

/// As find_best_split(). Lane i has the split before bin i. @param all the range's box.
inline __device__ ObjectSplit best_object_split(const WaveGroup& group, const ObjectBins& bins, const Box& all) {
  const unsigned lane = group.lane();
  LaneChoice best(SimdBox::kInfinity, 0);
  float overlap = 0.0f;
  std::uint32_t count_of_best = 0;
  for (unsigned axis = 0; axis < 3; ++axis) {
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
    }
  }
  best = best_of_lanes(group, best);
  const unsigned from = best.tie & 31u;
  if (!best.exists()) return {SimdBox::kInfinity, ObjectSplit::kNoAxis, 0, half_area(all), 0};
  return {best.value(), best.tie >> 5, from, from_lane(group, from, overlap), group.from(from, count_of_best)};
}

// Cuts of space -------------------------------------------------------------------------------------------------------

/// SpatialSplit as it lies in memory.
struct Cut {
  float cost;
  std::uint32_t axis;
  float plane;
  Box left, right;
  std::uint32_t left_count, right_count;
};

inline constexpr unsigned kLeftSide = 1, kRightSide = 2;

/// Sides on which a reference, or parts of it, are. Counts and boxes of the cut are those that it was chosen by: on the
/// host each reference that stays whole changes them for the next, which would need an order here.
inline __device__ unsigned cut_sides(const Cut& cut, const Box& box) {
  if (pick(box.max, cut.axis) <= cut.plane) return kLeftSide;
  if (pick(box.min, cut.axis) >= cut.plane) return kRightSide;
  SpatialSplit split;
  split.left = to_simd(cut.left);
  split.right = to_simd(cut.right);
  split.left_count = cut.left_count;
  split.right_count = cut.right_count;
  const CutSide side = cheapest_side(split, to_simd(box));
  return side == CutSide::kLeft ? kLeftSide : side == CutSide::kRight ? kRightSide : kLeftSide | kRightSide;
}

/// Axis k of the result is axis (k + by) % 3. Then the axis to cut along is one that the compiler knows.
inline __device__ void rotate(float (&v)[3], unsigned by) {
  const float x = v[0], y = v[1], z = v[2];
  v[0] = by == 0 ? x : by == 1 ? y : z;
  v[1] = by == 0 ? y : by == 1 ? z : x;
  v[2] = by == 0 ? z : by == 1 ? x : y;
}
inline __device__ void rotate(Box& box, unsigned by) {
  rotate(box.min, by);
  rotate(box.max, by);
}
inline __device__ void rotate(LeafCorners& corners, unsigned by) {
#pragma unroll
  for (unsigned k = 0; k < 4; ++k) rotate(corners.v[k].x, by);
}

/// @pre triangles.
inline __device__ LeafCorners corners_of(const GeometryTable& geometries, const Reference& reference) {
  const GeometryView mesh = geometries[geometries.find(reference.primitive)];
  return leaf_corners(mesh, reference.primitive - mesh.first, reference.contents);
}

struct Parts {
  Box left, right;
};
/// @pre the plane crosses the reference's box.
inline __device__ Parts cut_reference(const GeometryTable& geometries, const Reference& reference, unsigned axis,
                                      float plane) {
  LeafCorners corners = corners_of(geometries, reference);
  Box whole = reference.box;
  rotate(corners, axis);
  rotate(whole, axis);
  const SplitBounds bounds = split_bounds(corners, reference.contents.is_pair(), to_simd(whole), 0u, plane);
  Parts parts{to_box(bounds.left), to_box(bounds.right)};
  rotate(parts.left, axis == 0 ? 0 : 3 - axis);
  rotate(parts.right, axis == 0 ? 0 : 3 - axis);
  return parts;
}

/// One axis of a reference. Most are in one slab: only others need their corners.
inline __device__ void bin_slabs(const SlabBins& bins, const SlabPlanes& planes, const GeometryTable& geometries,
                                 const Reference& reference, unsigned axis) {
  const int begin = planes.first(pick(reference.box.min, axis), static_cast<int>(axis));
  const int end = planes.last(pick(reference.box.max, axis), static_cast<int>(axis));
  LeafCorners corners{};
  Box whole = reference.box;
  rotate(whole, axis);
  if (begin < end) {
    corners = corners_of(geometries, reference);
    rotate(corners, axis);
  }
  SlabPlanes::cut(planes.plane[axis], begin, end, corners, reference.contents.is_pair(), to_simd(whole), 0,
                  [&](int slab, const SimdBox& part) {
                    std::uint32_t low[3], high[3];
                    for (int k = 0; k < 3; ++k) {
                      low[k] = to_ordered(part.min[k]);
                      high[k] = to_ordered(part.max[k]);
                    }
                    bins.add(axis, static_cast<unsigned>(slab), axis, low, high);
                  });
  bins.count(axis, 0, static_cast<unsigned>(begin));
  bins.count(axis, 1, static_cast<unsigned>(begin < end ? end : begin));
}

/// As SpatialBins::best(). Lane i has the cut before slab i. @return infinite cost if there is none; the same in all
/// lanes.
inline __device__ Cut best_cut(const WaveGroup& group, const SlabBins& bins, const Box& all, std::uint32_t most) {
  const unsigned lane = group.lane();
  LaneChoice best(SimdBox::kInfinity, 0);
  Cut cut{};
  for (unsigned axis = 0; axis < 3; ++axis) {
    const bool mine = lane < kSpatialBins;
    Box right = mine ? bins.box(axis, lane) : empty_box();
    Box left = mine && lane > 0 ? bins.box(axis, lane - 1) : empty_box();
    const std::uint32_t begins = mine ? *bins.at(axis, 6, lane) : 0, ends = mine ? *bins.at(axis, 7, lane) : 0;
    const std::uint32_t left_count = sum_up(group, begins) - begins;
    const std::uint32_t right_count = sum_down(group, ends, kSpatialBins);
    sum_up(group, left, 0, 4);
    sum_down(group, right, kSpatialBins, 4);
    const float cost = side_cost(left, left_count) + side_cost(right, right_count);
    const bool fits = mine && left_count != 0 && right_count != 0 && left_count + right_count <= most;
    const LaneChoice choice(fits ? cost : SimdBox::kInfinity, axis << 5 | lane);
    if (choice.cost >= best.cost) continue;
    best = choice;
    cut = {cost, axis, 0.0f, left, right, left_count, right_count};
  }
  best = best_of_lanes(group, best);
  const unsigned from = best.tie & 31u, axis = best.tie >> 5;
  Cut result{best.value(),
             axis,
             SlabPlanes::at(pick(all.min, axis), pick(all.max, axis), static_cast<int>(from)),
             from_lane(group, from, cut.left),
             from_lane(group, from, cut.right),
             group.from(from, cut.left_count),
             group.from(from, cut.right_count)};
  return result;
}

/// The group's part of SlabPlanes::over().
inline __device__ void fill_planes(SlabPlanes& planes, const Box& box, unsigned thread, unsigned threads) {
  for (unsigned i = thread; i < 3 * (kSpatialBins + 1); i += threads) {
    const unsigned axis = i / (kSpatialBins + 1), k = i % (kSpatialBins + 1);
    planes.plane[axis][k] = SlabPlanes::at(pick(box.min, axis), pick(box.max, axis), static_cast<int>(k));
  }
}

}  // namespace hiprt::build::kernels
