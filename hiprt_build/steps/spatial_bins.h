#pragma once
/// Where to cut space, and the references in it (Stich, Friedrich, Dietrich, "Spatial splits in bounding volume
/// hierarchies", 2009). Internal.

#include <hiprt_build/steps/clip.h>
#include <hiprt_build/steps/sah_bins.h>

namespace hiprt::build {

inline constexpr int kSpatialBins = 16;

/// Planes that cut a box into slabs of the same width, on each axis.
struct SlabPlanes {
  float plane[3][kSpatialBins + 1];  ///< [i]: between slabs i - 1 and i; never decreasing.

  explicit SlabPlanes(const Aabb& box) {
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i <= kSpatialBins; ++i) {
        const float share = static_cast<float>(i) / kSpatialBins;
        plane[axis][i] = (1.0f - share) * box.min[axis] + share * box.max[axis];
      }
  }
  /// The slab in which a reference that begins at @p x begins: of two it is the upper.
  int first(float x, int axis) const {
    return find(axis, [x](float p) { return p <= x; });
  }
  /// The slab in which one that ends at @p x ends: of two it is the lower.
  int last(float x, int axis) const {
    return find(axis, [x](float p) { return p < x; });
  }

 private:
  /// The number of inner planes for which below() holds: those before the others.
  template <class Below> int find(int axis, const Below& below) const {
    int low = 0, high = kSpatialBins - 1;
    while (low < high) {
      const int middle = (low + high + 1) / 2;
      if (below(plane[axis][middle]))
        low = middle;
      else
        high = middle - 1;
    }
    return low;
  }
};

/// A cut of space, and what it makes of the references.
struct SpatialSplit {
  float cost = Aabb::kInfinity;  ///< As Split::cost.
  unsigned axis = 0;
  float plane = 0.0f;
  Aabb left, right;
  std::uint32_t left_count = 0, right_count = 0;  ///< Cut references count on both sides.
};

/// Boxes of the parts of references in each slab, and how many references begin and end there.
struct SpatialBins {
  Aabb box[3][kSpatialBins];
  std::uint32_t begin[3][kSpatialBins] = {}, end[3][kSpatialBins] = {};

  void add(const PrimitiveSoup& soup, const PrimitiveGroup& group, const Reference& reference,
           const SlabPlanes& planes) {
    const Aabb whole = reference.box();
    for (int axis = 0; axis < 3; ++axis) {
      const int first = planes.first(whole.min[axis], axis), last = std::max(first, planes.last(whole.max[axis], axis));
      ++begin[axis][first];
      ++end[axis][last];
      Aabb rest = whole;
      for (int i = first; i < last; ++i) {
        const SplitBounds parts =
            split_bounds(soup, group, rest, static_cast<unsigned>(axis), planes.plane[axis][i + 1]);
        box[axis][i].add(parts.left);
        rest = parts.right;
      }
      box[axis][last].add(rest);
    }
  }
  void add(const SpatialBins& other) {
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < kSpatialBins; ++i) {
        box[axis][i].add(other.box[axis][i]);
        begin[axis][i] += other.begin[axis][i];
        end[axis][i] += other.end[axis][i];
      }
  }

  /// The cheapest cut that makes at most @p most references, counting both sides. Infinite cost: there is none.
  SpatialSplit best(const SlabPlanes& planes, std::size_t most) const {
    SpatialSplit result;
    for (int axis = 0; axis < 3; ++axis) {
      Aabb right_box[kSpatialBins];
      std::uint32_t right_count[kSpatialBins];
      Aabb right;
      std::uint32_t count = 0;
      for (int i = kSpatialBins - 1; i > 0; --i) {
        right.add(box[axis][i]);
        count += end[axis][i];
        right_box[i] = right;
        right_count[i] = count;
      }
      Aabb left;
      count = 0;
      for (int i = 1; i < kSpatialBins; ++i) {
        left.add(box[axis][i - 1]);
        count += begin[axis][i - 1];
        if (count == 0 || right_count[i] == 0 || count + right_count[i] > most) continue;
        const float cost =
            half_area(left) * static_cast<float>(count) + half_area(right_box[i]) * static_cast<float>(right_count[i]);
        if (!(cost < result.cost)) continue;
        result = SpatialSplit{
            cost, static_cast<unsigned>(axis), planes.plane[axis][i], left, right_box[i], count, right_count[i]};
      }
    }
    return result;
  }
};

}  // namespace hiprt::build
