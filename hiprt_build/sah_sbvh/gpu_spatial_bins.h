#pragma once
/// Bins for the parts of references between planes, and the best spatial split. Internal.

#include <hiprt_build/sah_sbvh/gpu_object_bins.h>
#include <hiprt_build/sah_sbvh/spatial_bins.h>

namespace hiprt::build::kernels {

/// Counts of a slab: references that begin there, and references that end there.
using SlabBins = BinWords<kSpatialBins, 2>;

/// Boxes of whole references, in the slab where they begin and in that where they end: for splits that cut nothing.
struct WholeSlabs {
  using Boxes = BinWords<kSpatialBins, 0>;
  static constexpr unsigned kSize = 2 * Boxes::kSize;

  std::uint32_t* words;
  bool used;  ///< If not, the functions do nothing, and there is no memory.

  __device__ Boxes boxes(bool ends) const { return Boxes{words + (ends ? Boxes::kSize : 0)}; }
  /// Part @p thread of @p threads.
  __device__ void clear(unsigned thread, unsigned threads) const {
    if (!used) return;
    boxes(false).clear(thread, threads);
    boxes(true).clear(thread, threads);
  }
  __device__ void add(unsigned axis, const SlabSpan& span, const Box& whole) const {
    if (!used) return;
    std::uint32_t low[3], high[3];
    to_ordered(whole, low, high);
#pragma unroll 1
    for (unsigned ends = 0; ends < 2; ++ends)
      boxes(ends != 0).add(axis, static_cast<unsigned>(ends != 0 ? span.end : span.begin), 0, low, high);
  }
  /// Adds all of another's, part @p thread of @p threads.
  __device__ void add(const WholeSlabs& other, unsigned thread, unsigned threads) const {
    if (!used) return;
    boxes(false).add(other.boxes(false), thread, threads);
    boxes(true).add(other.boxes(true), thread, threads);
  }
};

/// SpatialSplit in the layout of device memory.
struct SpatialSplitRecord {
  float cost;
  std::uint32_t axis;
  float plane;
  SplitSide crossing;
  Box left, right;
  std::uint32_t left_count, right_count;

  /// The cost by which splits are compared with each other. @param share as SplitRules::whole_share.
  __device__ float compared(float share) const { return crossing == SplitSide::kBoth ? cost : cost / share; }
};

inline constexpr unsigned kLeftSide = 1, kRightSide = 2;

/// @return the sides that get a reference or a part of it. The decision uses the counts and boxes of the chosen split.
/// On the host each reference that stays whole changes them for the next reference; on the GPU there is no such order.
inline __device__ unsigned spatial_sides(const SpatialSplitRecord& cut, const Box& box) {
  SplitSide side = side_of(cut.crossing, cut.plane, pick(box.min, cut.axis), pick(box.max, cut.axis));
  if (side == SplitSide::kBoth) {
    SpatialSplit split;
    split.left = to_simd(cut.left);
    split.right = to_simd(cut.right);
    split.left_count = cut.left_count;
    split.right_count = cut.right_count;
    side = cheapest_side(split, to_simd(box));
  }
  return side == SplitSide::kLeft ? kLeftSide : side == SplitSide::kRight ? kRightSide : kLeftSide | kRightSide;
}

/// Axis k of the result is axis (k + by) % 3. After it the axis of a split is always 0, which the compiler knows.
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

/// @pre the reference holds triangles.
inline __device__ LeafCorners corners_of(const GeometryTable& geometries, const Reference& reference) {
  const GeometryView mesh = geometries[geometries.find(reference.primitive)];
  return leaf_corners(mesh, reference.primitive - mesh.first, reference.contents);
}

struct Parts {
  Box left, right;
};
/// @pre the plane crosses the reference's box.
inline __device__ Parts split_reference(const GeometryTable& geometries, const Reference& reference, unsigned axis,
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

/// The counts of SlabBins alone.
struct SlabCounts {
  static constexpr unsigned kSize = 3 * 2 * kSpatialBins;

  std::uint32_t* words;

  /// Part @p thread of @p threads.
  __device__ void clear(unsigned thread, unsigned threads) const {
    for (unsigned i = thread; i < kSize; i += threads) words[i] = 0;
  }
  __device__ void count(unsigned axis, unsigned word, unsigned slab) const {
    fetch_add(words + (axis * 2 + word) * kSpatialBins + slab, 1);
  }
  /// Adds all to those of @p bins, part @p thread of @p threads.
  __device__ void add_to(const SlabBins& bins, unsigned thread, unsigned threads) const {
    for (unsigned i = thread; i < kSize; i += threads) {
      const unsigned row = i / kSpatialBins;
      if (words[i] != 0) fetch_add(bins.at(row / 2, 6 + row % 2, i % kSpatialBins), words[i]);
    }
  }
};

inline __device__ SlabSpan span_of(const SlabPlanes& planes, const Box& box, unsigned axis) {
  return planes.span(static_cast<int>(axis), pick(box.min, axis), pick(box.max, axis));
}

/// Adds a box to a slab. Axis k of the box is axis (k + rotation) % 3.
inline __device__ void add_part(const SlabBins& bins, unsigned axis, int slab, unsigned rotation, const SimdBox& part) {
  std::uint32_t low[3], high[3];
  to_ordered(to_box(part), low, high);
  bins.add(axis, static_cast<unsigned>(slab), rotation, low, high);
}
/// Counts a reference where it begins and where it ends. @tparam Counts SlabBins or SlabCounts.
template <class Counts> __device__ void count_ends(const Counts& counts, unsigned axis, const SlabSpan& span) {
  counts.count(axis, 0, static_cast<unsigned>(span.begin));
  counts.count(axis, 1, static_cast<unsigned>(span.end));
}
template <class Counts> __device__ void count_ends(const Counts& counts, const SlabPlanes& planes, const Box& box) {
#pragma unroll 1
  for (unsigned axis = 0; axis < 3; ++axis) count_ends(counts, axis, span_of(planes, box, axis));
}

/// As SpatialBins::groups() and SpatialBins::crossing(), of an axis. The same in all lanes.
struct AxisSums {
  std::uint32_t begins, crossing;

  /// @param size references. @param most as of SpatialBins::groups().
  __device__ AxisSums(const WaveGroup& group, const SlabBins& bins, unsigned axis, std::uint32_t size,
                      std::uint32_t most) {
    const unsigned lane = group.lane();
    const bool mine = lane < kSpatialBins;
    const std::uint32_t begin = mine ? *bins.at(axis, 6, lane) : 0, end = mine ? *bins.at(axis, 7, lane) : 0;
    const std::uint32_t left = sum_up(group, begin) - begin, right = sum_down(group, end, kSpatialBins);
    const bool fits = mine && left != 0 && right != 0 && left + right <= most;
    begins = (group.ballot(fits) & SlabGroups::kSingle) | 1u;
    crossing = mine && lane != 0 ? left + right - size : 0;
    for (unsigned step = 1; step < kSpatialBins; step *= 2) {
      const std::uint32_t other = group.from(lane ^ step, crossing);
      crossing = other > crossing ? other : crossing;
    }
    crossing = group.from(0, crossing);
  }
};
/// The same of all axes.
struct SlabSums {
  SlabGroups groups;
  std::uint32_t crossing;
};
inline __device__ SlabSums sum_slabs(const WaveGroup& group, const SlabBins& bins, std::uint32_t size,
                                     std::uint32_t most) {
  SlabSums sums{SlabGroups::single(), 0};
#pragma unroll 1
  for (unsigned axis = 0; axis < 3; ++axis) {
    const AxisSums mine(group, bins, axis, size, most);
    sums.groups.set(axis, mine.begins);
    sums.crossing = mine.crossing > sums.crossing ? mine.crossing : sums.crossing;
  }
  return sums;
}

/// Adds parts of a reference that planes between groups cut. @param span of some of its groups.
inline __device__ void bin_cut(const SlabBins& bins, const SlabPlanes& planes, const SlabGroups& groups,
                               const GeometryTable& geometries, const Reference& reference, unsigned axis,
                               const SlabSpan& span) {
  LeafCorners corners = corners_of(geometries, reference);
  Box whole = reference.box;
  rotate(whole, axis);
  rotate(corners, axis);
  SlabPlanes::parts(planes.plane[axis], static_cast<int>(axis), groups, span, corners, reference.contents.is_pair(),
                    to_simd(whole), 0, [&](int slab, const SimdBox& part) { add_part(bins, axis, slab, axis, part); });
}

/// Adds references to the bins. Most are in one slab. The others take long: they wait in shared memory, so that
/// neighbouring lanes have a few groups each.
/// @tparam kThreads that call each function together.
template <unsigned kThreads> struct SlabQueue {
  static constexpr int kGroups = 4;                                ///< Most groups of an item.
  static constexpr unsigned kMost = 3 * (kSpatialBins / kGroups);  ///< Items that a thread may add at a time.
  static constexpr unsigned kSize = (kMost + 2) * kThreads;

  /// Groups of a reference along an axis. A slab's number has 4 bits.
  class Item {
    static_assert(kSpatialBins <= 16);

   public:
    Item() = default;
    __device__ Item(unsigned number, unsigned axis, const SlabSpan& span)
        : bits_(number << 12 | axis << 8 | static_cast<unsigned>(span.begin) << 4 | static_cast<unsigned>(span.end)) {}
    __device__ unsigned number() const { return bits_ >> 12; }
    __device__ unsigned axis() const { return bits_ >> 8 & 15u; }
    __device__ SlabSpan span() const { return {static_cast<int>(bits_ >> 4 & 15u), static_cast<int>(bits_ & 15u)}; }

   private:
    std::uint32_t bits_;
  };

  std::uint32_t count;
  Item items[kSize];

  /// By one thread. Follow it with a barrier.
  __device__ void clear() { count = 0; }
  /// A reference in one group of slabs is added; otherwise it waits.
  /// @param number below 2^20. @param counts whether it is to be counted, too.
  __device__ void add(const SlabBins& bins, const WholeSlabs& whole, const SlabPlanes& planes, const SlabGroups& groups,
                      const Reference& reference, unsigned number, bool counts) {
#pragma unroll 1
    for (unsigned axis = 0; axis < 3; ++axis) {
      const SlabSpan span = span_of(planes, reference.box, axis);
      if (counts) count_ends(bins, axis, span);
      whole.add(axis, span, reference.box);
      const int along = static_cast<int>(axis);
      if (groups.behind(along, span.begin) > span.end) {
        add_part(bins, axis, groups.first(along, span.begin), 0, to_simd(reference.box));
        continue;
      }
      for (int slab = span.begin; slab <= span.end;) {
        int next = slab;
        for (int i = 0; i < kGroups && next <= span.end; ++i) next = groups.behind(along, next);
        next = next <= span.end ? next : span.end + 1;
        items[fetch_add(&count, 1)] = Item(number, axis, {slab, next - 1});
        slab = next;
      }
    }
  }
  /// The references that wait. @param get (number): the reference. Barriers belong before it and behind it.
  template <class Get>
  __device__ void work(const SlabBins& bins, const SlabPlanes& planes, const SlabGroups& groups,
                       const GeometryTable& geometries, unsigned thread, Get&& get) const {
    for (unsigned i = thread; i < count; i += kThreads)
      bin_cut(bins, planes, groups, geometries, get(items[i].number()), items[i].axis(), items[i].span());
  }
};

/// As SpatialBins::best() and WholeBins::best(), across axes [first, last): lane i evaluates the split before slab i.
/// @param share as SplitRules::whole_share. @return infinite cost if there is no split; the same result in all lanes.
inline __device__ SpatialSplitRecord best_spatial_split(const WaveGroup& group, const SlabBins& bins,
                                                        const WholeSlabs& whole, float share, const Box& all,
                                                        std::uint32_t most, unsigned first = 0, unsigned last = 3) {
  const unsigned lane = group.lane(), kinds = whole.used ? 3 : 1;
  LaneChoice best(SimdBox::kInfinity, 0);
  SpatialSplitRecord cut{};
#pragma unroll 1
  for (unsigned i = first * kinds; i < last * kinds; ++i) {
    const unsigned axis = i / kinds, kind = i % kinds;
    const auto crossing = static_cast<SplitSide>(kind);
    const bool mine = lane < kSpatialBins, by_end = crossing == SplitSide::kRight;
    const std::uint32_t* row = kind == 0 ? bins.at(axis, 0, 0) : whole.boxes(by_end).at(axis, 0, 0);
    Box right = mine ? SlabBins::box_of(row, lane) : empty_box();
    Box left = mine && lane > 0 ? SlabBins::box_of(row, lane - 1) : empty_box();
    const std::uint32_t low = mine ? *bins.at(axis, by_end ? 7 : 6, lane) : 0;
    const std::uint32_t high = mine ? *bins.at(axis, crossing == SplitSide::kLeft ? 6 : 7, lane) : 0;
    const std::uint32_t left_count = sum_up(group, low) - low, right_count = sum_down(group, high, kSpatialBins);
    sum_up(group, left, 0, 4);
    sum_down(group, right, kSpatialBins, 4);
    const float cost = side_cost(left, left_count) + side_cost(right, right_count);
    const bool fits = mine && left_count != 0 && right_count != 0 && left_count + right_count <= most;
    const SpatialSplitRecord split{cost, axis, 0.0f, crossing, left, right, left_count, right_count};
    const LaneChoice choice(fits ? split.compared(share) : SimdBox::kInfinity, i << 5 | lane);
    if (choice.cost >= best.cost) continue;
    best = choice;
    cut = split;
  }
  best = best_of_lanes(group, best);
  const unsigned from = best.tie & 31u, axis = (best.tie >> 5) / kinds;
  const float cost = from_lane(group, from, cut.cost);
  return {best.exists() ? cost : SimdBox::kInfinity,
          axis,
          SlabPlanes::at(pick(all.min, axis), pick(all.max, axis), static_cast<int>(from)),
          static_cast<SplitSide>((best.tie >> 5) % kinds),
          from_lane(group, from, cut.left),
          from_lane(group, from, cut.right),
          group.from(from, cut.left_count),
          group.from(from, cut.right_count)};
}

/// SlabPlanes::over() by @p threads threads together.
inline __device__ void fill_planes(SlabPlanes& planes, const Box& box, unsigned thread, unsigned threads) {
  for (unsigned i = thread; i < 3 * (kSpatialBins + 1); i += threads) {
    const unsigned axis = i / (kSpatialBins + 1), k = i % (kSpatialBins + 1);
    planes.plane[axis][k] = SlabPlanes::at(pick(box.min, axis), pick(box.max, axis), static_cast<int>(k));
  }
}

}  // namespace hiprt::build::kernels
