#pragma once
/// Object splits of a range of references by the surface area heuristic. Large ranges use bins (Wald, "On fast
/// construction of SAH-based bounding volume hierarchies", 2007), small ranges an exact sweep. Internal.

#include <hiprt_build/tree/binary_tree.h>

#include <array>
#include <span>

namespace hiprt::build {

/// Half the centre of a box. The factor keeps sums and extents finite for every finite box.
HIPRT_HD HIPRT_FORCE_INLINE Float4 split_position(const SimdBox& box) { return 0.25f * box.min + 0.25f * box.max; }

/// Boxes of a range of references and of their split positions.
struct RangeBounds {
  SimdBox box, centers;

  HIPRT_HD HIPRT_FORCE_INLINE void add(const SimdBox& reference) {
    box.add(reference);
    centers.add(split_position(reference));
  }
  HIPRT_HD HIPRT_FORCE_INLINE void add(const RangeBounds& other) {
    box.add(other.box);
    centers.add(other.centers);
  }
};

inline constexpr int kMaxBins = 32;

/// Maps split positions to bins on each axis. Counting and partitioning use the same mapping.
struct BinMapping {
  Float4 base, scale;
  int bins;

  HIPRT_HD HIPRT_FORCE_INLINE BinMapping(const SimdBox& centers, std::size_t count)
      : base(centers.min), scale{}, bins(count < 16 * (kMaxBins - 4) ? static_cast<int>(4 + count / 16) : kMaxBins) {
    const Float4 extent = centers.max - centers.min;
    for (int axis = 0; axis < 3; ++axis)
      // Slightly less than bins / extent, so that the largest centre falls into the last bin.
      scale[axis] = extent[axis] > 0x1p-120f ? 0.99999f * static_cast<float>(bins) / extent[axis] : 0.0f;
  }
  HIPRT_HD HIPRT_FORCE_INLINE std::array<int, 3> operator()(const SimdBox& box) const {
    const Float4 position = (split_position(box) - base) * scale;
    return {within(position[0]), within(position[1]), within(position[2])};
  }

 private:
  HIPRT_HD HIPRT_FORCE_INLINE int within(float position) const {
    const int bin = static_cast<int>(position);
    return bin < 0 ? 0 : bin < bins ? bin : bins - 1;
  }
};

/// @return the cost of one side of a split, in the unit of Split::cost.
HIPRT_HD HIPRT_FORCE_INLINE float side_cost(const SimdBox& box, std::uint32_t count) {
  return half_area(box) * static_cast<float>(count);
}

/// Boxes and counts of the bins of all axes.
struct Bins {
  SimdBox box[3][kMaxBins];
  std::uint32_t count[3][kMaxBins] = {};

  void add(std::span<const Reference> references, const BinMapping& mapping) {
    for (const Reference& reference : references) {
      const SimdBox b = simd_box(reference);
      const std::array<int, 3> bin = mapping(b);
      for (int axis = 0; axis < 3; ++axis) {
        box[axis][bin[static_cast<std::size_t>(axis)]].add(b);
        ++count[axis][bin[static_cast<std::size_t>(axis)]];
      }
    }
  }
  void add(const Bins& other, int bins) {
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < bins; ++i) {
        box[axis][i].add(other.box[axis][i]);
        count[axis][i] += other.count[axis][i];
      }
  }
};

struct Split {
  float cost = SimdBox::kInfinity;  ///< Sum over both sides of half area * references.
  int axis = -1;                    ///< -1: there is no split.
  int bin = 0;                      ///< First bin of the right side.
};

/// The cheapest split between bins. Ties go to the lower axis, then the lower bin.
inline Split find_best_split(const Bins& bins, const BinMapping& mapping) {
  Split best;
  for (int axis = 0; axis < 3; ++axis) {
    float right_cost[kMaxBins];
    SimdBox box;
    std::uint32_t count = 0;
    for (int i = mapping.bins - 1; i > 0; --i) {
      box.add(bins.box[axis][i]);
      count += bins.count[axis][i];
      right_cost[i] = count == 0 ? -1.0f : side_cost(box, count);
    }
    box = SimdBox{};
    count = 0;
    for (int i = 1; i < mapping.bins; ++i) {
      box.add(bins.box[axis][i - 1]);
      count += bins.count[axis][i - 1];
      const float cost = side_cost(box, count) + right_cost[i];
      if (count == 0 || right_cost[i] < 0.0f || !(cost < best.cost)) continue;
      best = Split{cost, axis, i};
    }
  }
  return best;
}

/// Ranges up to this size are split by an exact sweep.
inline constexpr std::size_t kSweepSize = 8;

/// Sorts up to kSweepSize references along the best axis. @return how many belong to the left side (at least 1), 0 if
/// no split has a finite cost.
inline std::size_t sweep_split(std::span<Reference> references) {
  using Order = std::array<std::uint8_t, kSweepSize>;
  const std::size_t n = references.size();
  Float4 center[kSweepSize];
  for (std::size_t i = 0; i < n; ++i) center[i] = split_position(simd_box(references[i]));
  float best_cost = SimdBox::kInfinity;
  std::size_t best_left = 0;
  Order best_order{};
  for (int axis = 0; axis < 3; ++axis) {
    Order order{};
    for (std::size_t i = 0; i < n; ++i) {
      std::size_t at = i;
      for (; at > 0 && center[order[at - 1]][axis] > center[i][axis]; --at) order[at] = order[at - 1];
      order[at] = static_cast<std::uint8_t>(i);
    }
    float right_cost[kSweepSize];
    SimdBox box;
    for (std::size_t i = n - 1; i > 0; --i) {
      box.add(simd_box(references[order[i]]));
      right_cost[i] = half_area(box) * static_cast<float>(n - i);
    }
    box = SimdBox{};
    for (std::size_t i = 1; i < n; ++i) {
      box.add(simd_box(references[order[i - 1]]));
      const float cost = half_area(box) * static_cast<float>(i) + right_cost[i];
      if (!(cost < best_cost)) continue;
      best_cost = cost;
      best_left = i;
      best_order = order;
    }
  }
  if (best_left == 0) return 0;
  Reference sorted[kSweepSize];
  for (std::size_t i = 0; i < n; ++i) sorted[i] = references[best_order[i]];
  std::copy_n(sorted, n, references.begin());
  return best_left;
}

}  // namespace hiprt::build
