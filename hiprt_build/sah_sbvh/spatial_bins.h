#pragma once
/// Spatial splits (Stich, Friedrich, Dietrich, "Spatial splits in bounding volume
/// hierarchies", 2009). Internal.

#include <hiprt_build/presplit/clip.h>
#include <hiprt_build/sah_sbvh/sah_bins.h>
#include <hiprt_device/math/arithmetic.h>

#include <bit>
#include <limits>

namespace hiprt::build {

inline constexpr int kSpatialBins = 16;

/// Ranges of fewer references get no spatial split: cuts of the last two gain nothing (decision 0023).
inline constexpr std::uint32_t kLeastCutRange = 3;

/// Whether the halves of a range overlap so much that a spatial split is tried. Stich et al. compare with the scene
/// alone (section 4.5). Cuts where less than a tenth of the range overlaps gain nothing.
/// @param overlap half the area of what both halves have in common. @param least for the scene. @param area half the
/// area of the range's box.
HIPRT_HD HIPRT_FORCE_INLINE bool halves_overlap(float overlap, float least, float area) {
  return overlap > least && overlap > 0.1f * area;
}

/// A half of a range: its references, and half the area of its box.
struct HalfRange {
  std::size_t count;
  float area;
};

/// What the left half of a range gets of the capacity for references that cuts will make.
///
/// By the number of references, and by the length of the boxes: large references need more cuts. By number alone a few
/// large triangles beside many small ones have no capacity where others do not use theirs (decision 0023).
HIPRT_HD HIPRT_FORCE_INLINE std::size_t left_capacity(std::size_t capacity, const HalfRange& left,
                                                      const HalfRange& right) {
  const double weight = square_root(static_cast<double>(left.area)) * static_cast<double>(left.count);
  const double other = square_root(static_cast<double>(right.area)) * static_cast<double>(right.count);
  // Boxes may have no area, or one that floats cannot hold.
  const bool by_area = weight + other > 0.0 && weight + other < std::numeric_limits<double>::infinity();
  const double share = by_area ? weight / (weight + other)
                               : static_cast<double>(left.count) / static_cast<double>(left.count + right.count);
  const auto wanted = static_cast<std::size_t>(static_cast<double>(capacity) * share);
  return wanted < capacity ? wanted : capacity;
}

/// Edges of a leaf's triangles, for their parts between planes across an axis.
struct TriangleEdges {
  Float4 corner[4];
  float inverse[5];  ///< Of the edges' lengths along the axis; 0 for those across it.
  int axis;
  bool pair;

  HIPRT_HD HIPRT_FORCE_INLINE TriangleEdges(const LeafCorners& corners, bool is_pair, int along)
      : corner{to_float4(corners.v[0]), to_float4(corners.v[1]), to_float4(corners.v[2]), to_float4(corners.v[3])},
        inverse{},
        axis(along),
        pair(is_pair) {
    for (int edge = 0; edge < 5; ++edge) {
      const float length = corner[last(edge)][axis] - corner[first(edge)][axis];
      inverse[edge] = length != 0.0f ? 1.0f / length : 0.0f;
    }
  }
  /// v0 v1, v1 v2, v2 v0, and of a pair v1 v3, v3 v2.
  HIPRT_HD static constexpr int first(int edge) { return edge == 3 ? 1 : edge == 4 ? 3 : edge; }
  HIPRT_HD static constexpr int last(int edge) { return edge < 3 ? (edge + 1) % 3 : edge == 3 ? 3 : 2; }

  /// Of the points where edges cross a plane; may be empty.
  HIPRT_HD HIPRT_FORCE_INLINE SimdBox in_plane(float plane) const {
    SimdBox box;
    for (int edge = 0; edge < 5; ++edge) {
      if (edge > 2 && !pair) break;
      const Float4 from = corner[first(edge)];
      const float share = (plane - from[axis]) * inverse[edge];
      if (inverse[edge] != 0.0f && share >= 0.0f && share <= 1.0f) box.add(from + share * (corner[last(edge)] - from));
    }
    return box;
  }
  /// Adds the corners between two planes.
  HIPRT_HD HIPRT_FORCE_INLINE void add_corners(SimdBox& box, float low, float high) const {
    for (int i = 0; i < 4; ++i) {
      if (i > 2 && !pair) break;
      if (corner[i][axis] >= low && corner[i][axis] <= high) box.add(corner[i]);
    }
  }
};

/// The slabs of an axis that a reference is in.
struct SlabSpan {
  int begin, end;  ///< The first and the last.
};

/// Neighbouring slabs, joined where no plane between them may be chosen. References get one part per group, not one per
/// slab. Where very many triangles overlap, that saves most of the time.
struct SlabGroups {
  static constexpr std::uint32_t kSingle = (1u << kSpatialBins) - 1;

  std::uint32_t begins[3];  ///< By axis. Bit i: a group begins with slab i; bit 0 is set.

  /// Every slab is a group.
  HIPRT_HD static SlabGroups single() { return {{kSingle, kSingle, kSingle}}; }
  HIPRT_HD bool has_planes() const { return (begins[0] | begins[1] | begins[2]) != 1u; }
  /// Sets an axis that the compiler does not know, without an array in memory.
  HIPRT_HD HIPRT_FORCE_INLINE void set(unsigned axis, std::uint32_t of_axis) {
    begins[0] = axis == 0 ? of_axis : begins[0];
    begins[1] = axis == 1 ? of_axis : begins[1];
    begins[2] = axis == 2 ? of_axis : begins[2];
  }
  /// @return the first slab of the group that a slab is in.
  HIPRT_HD HIPRT_FORCE_INLINE int first(int axis, int slab) const {
    return static_cast<int>(std::bit_width(begins[axis] & ((2u << slab) - 1))) - 1;
  }
  /// @return the slab behind the group that a slab is in.
  HIPRT_HD HIPRT_FORCE_INLINE int behind(int axis, int slab) const {
    return static_cast<int>(lowest_bit((begins[axis] | 1u << kSpatialBins) & ~((2u << slab) - 1)));
  }
};

/// SlabGroups::single(), known to the compiler. The bits of SlabGroups would make sbvh 2 to 6 % slower on a CPU, and 4
/// to 13 % on a GPU.
struct SingleSlabs {
  HIPRT_HD int first(int, int slab) const { return slab; }
  HIPRT_HD int behind(int, int slab) const { return slab + 1; }
};

/// Planes that cut a box into slabs of the same width, on each axis.
struct SlabPlanes {
  float plane[3][kSpatialBins + 1];  ///< [i]: between slabs i - 1 and i; never decreasing.

  HIPRT_HD HIPRT_FORCE_INLINE static SlabPlanes over(const SimdBox& box) {
    SlabPlanes planes;
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i <= kSpatialBins; ++i) planes.plane[axis][i] = at(box.min[axis], box.max[axis], i);
    return planes;
  }
  /// Plane @p i of an axis on which the box is so long.
  HIPRT_HD HIPRT_FORCE_INLINE static float at(float min, float max, int i) {
    const float share = static_cast<float>(i) / kSpatialBins;
    return (1.0f - share) * min + share * max;
  }
  /// The slabs of what reaches from @p min to @p max. It begins in the upper and ends in the lower of two slabs. What
  /// is flat and on a plane would end before it begins: it is in slab begin.
  HIPRT_HD HIPRT_FORCE_INLINE SlabSpan span(int axis, float min, float max) const {
    const int begin = find(min, axis, [min](float p) { return p <= min; });
    const int end = find(max, axis, [max](float p) { return p < max; });
    return {begin, begin < end ? end : begin};
  }
  /// visit(first slab of a group, box of the part there) for the groups of an axis that a reference is in, in their
  /// order. What is in one group stays whole. Boxes of parts are good enough to choose a cut by: they are not rounded
  /// outwards.
  /// @tparam Groups SlabGroups or SingleSlabs.
  /// @param row the axis's planes, which lie across @p along of the corners. @param whole the reference's box.
  template <class Groups, class Visit>
  HIPRT_HD HIPRT_FORCE_INLINE static void cut(const float* row, int axis, const Groups& groups, const SlabSpan& span,
                                              const LeafCorners& corners, bool pair, const SimdBox& whole, int along,
                                              Visit&& visit) {
    if (groups.behind(axis, span.begin) > span.end) return visit(groups.first(axis, span.begin), whole);
    parts(row, axis, groups, span, corners, pair, whole, along, visit);
  }
  /// The same for a reference in several groups. @param span of the slabs of some of them.
  template <class Groups, class Visit>
  HIPRT_HD HIPRT_FORCE_INLINE static void parts(const float* row, int axis, const Groups& groups, const SlabSpan& span,
                                                const LeafCorners& corners, bool pair, const SimdBox& whole, int along,
                                                Visit&& visit) {
    int slab = span.begin, plane = slab;
    const TriangleEdges edges(corners, pair, along);
    SimdBox in_low;
    float low = 0.0f;
    // in_plane() is called in one place: GPUs wait for instructions where code is large.
    for (;;) {
      const float high = row[plane];
      const SimdBox in_high = edges.in_plane(high);
      if (plane > slab) {
        SimdBox part = in_low;
        part.add(in_high);
        edges.add_corners(part, low, high);
        visit(groups.first(axis, slab), clip_detail::intersect(part, whole));
        if (plane > span.end) return;
        slab = plane;
      }
      const int behind = groups.behind(axis, slab);
      plane = behind <= span.end ? behind : span.end + 1;
      low = high;
      in_low = in_high;
    }
  }

 private:
  /// The number of inner planes for which below() holds: those before the others. @param x about where they change.
  template <class Below> HIPRT_HD HIPRT_FORCE_INLINE int find(float x, int axis, const Below& below) const {
    const float* row = plane[axis];
    const float guess = kSpatialBins * ((x - row[0]) / (row[kSpatialBins] - row[0]));
    int slab = guess > 0.0f ? (guess < kSpatialBins ? static_cast<int>(guess) : kSpatialBins - 1) : 0;
    while (slab + 1 < kSpatialBins && below(row[slab + 1])) ++slab;
    while (slab > 0 && !below(row[slab])) --slab;
    return slab;
  }
};

/// The sides that a reference goes to.
enum class SplitSide : std::uint8_t { kBoth, kLeft, kRight };

/// A split by a plane, and its halves.
struct SpatialSplit {
  float cost = SimdBox::kInfinity;  ///< As Split::cost.
  unsigned axis = 0;
  float plane = 0.0f;
  /// Where references go that cross the plane. kBoth: they are cut. Otherwise no reference is cut, and the references
  /// are divided by where their boxes begin (kLeft) or end (kRight).
  SplitSide crossing = SplitSide::kBoth;
  SimdBox left, right;
  std::uint32_t left_count = 0, right_count = 0;  ///< References on both sides count twice.
};

/// The sides of a reference that reaches from @p min to @p max along the axis. What is flat and on the plane lies
/// behind it if nothing is cut, as in SlabPlanes::span().
HIPRT_HD HIPRT_FORCE_INLINE SplitSide side_of(SplitSide crossing, float plane, float min, float max) {
  if (crossing == SplitSide::kLeft) return min < plane ? SplitSide::kLeft : SplitSide::kRight;
  if (crossing == SplitSide::kRight) return max > plane || min >= plane ? SplitSide::kRight : SplitSide::kLeft;
  return max <= plane ? SplitSide::kLeft : min >= plane ? SplitSide::kRight : SplitSide::kBoth;
}

/// @return one side if it is cheaper not to split the reference ("unsplitting", Stich et al. 2009, section 4.4).
/// @param whole the reference's box.
HIPRT_HD HIPRT_FORCE_INLINE SplitSide cheapest_side(const SpatialSplit& split, const SimdBox& whole) {
  SimdBox larger_left = split.left, larger_right = split.right;
  larger_left.add(whole);
  larger_right.add(whole);
  const float both = side_cost(split.left, split.left_count) + side_cost(split.right, split.right_count);
  const float only_left = side_cost(larger_left, split.left_count) + side_cost(split.right, split.right_count - 1);
  const float only_right = side_cost(split.left, split.left_count - 1) + side_cost(larger_right, split.right_count);
  if (only_left < both && only_left <= only_right) return SplitSide::kLeft;
  return only_right < both ? SplitSide::kRight : SplitSide::kBoth;
}

/// Boxes of the parts of references in each slab, and how many references begin and end there.
struct SpatialBins {
  SimdBox box[3][kSpatialBins];
  std::uint32_t begin[3][kSpatialBins] = {}, end[3][kSpatialBins] = {};

  /// Counts a reference where it begins and where it ends.
  void count(const SimdBox&, const SlabSpan (&spans)[3]) {
    for (int axis = 0; axis < 3; ++axis) {
      ++begin[axis][spans[axis].begin];
      ++end[axis][spans[axis].end];
    }
  }
  /// Adds the parts of a reference. @param whole its box. @tparam Groups SlabGroups or SingleSlabs.
  template <class Groups>
  void add(const LeafCorners& corners, bool pair, const SimdBox& whole, const SlabPlanes& planes,
           const SlabSpan (&spans)[3], const Groups& groups) {
    for (int axis = 0; axis < 3; ++axis)
      SlabPlanes::cut(planes.plane[axis], axis, groups, spans[axis], corners, pair, whole, axis,
                      [&](int slab, const SimdBox& part) { box[axis][slab].add(part); });
  }
  void add(const SpatialBins& other) {
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < kSpatialBins; ++i) {
        box[axis][i].add(other.box[axis][i]);
        begin[axis][i] += other.begin[axis][i];
        end[axis][i] += other.end[axis][i];
      }
  }

  /// @return the groups between the planes that may be chosen: those with at most @p most references on both sides
  /// together, and with some on each.
  SlabGroups groups(std::size_t most) const {
    SlabGroups result = SlabGroups::single();
    for (int axis = 0; axis < 3; ++axis) {
      std::size_t left = 0, right = 0;
      for (const std::uint32_t ends : end[axis]) right += ends;
      for (int i = 1; i < kSpatialBins; ++i) {
        left += begin[axis][i - 1];
        right -= end[axis][i - 1];
        if (left == 0 || right == 0 || left + right > most) result.begins[axis] &= ~(1u << i);
      }
    }
    return result;
  }
  /// @return the most references that a plane cuts.
  std::size_t crossing() const {
    std::size_t most = 0;
    for (int axis = 0; axis < 3; ++axis) {
      std::size_t open = 0;
      for (int i = 1; i < kSpatialBins; ++i) {
        open += begin[axis][i - 1];
        open -= end[axis][i - 1];
        most = open > most ? open : most;
      }
    }
    return most;
  }
  /// @return the cheapest split with at most @p most references on both sides together; infinite cost if there is none.
  SpatialSplit best(const SlabPlanes& planes, std::size_t most) const {
    SpatialSplit result;
    for (unsigned axis = 0; axis < 3; ++axis)
      choose(planes, axis, SplitSide::kBoth, box[axis], begin[axis], end[axis], most, result);
    return result;
  }

 protected:
  /// @param low, high references on the left side of the planes behind a slab, and on the right side of those before
  /// it.
  /// @param best becomes the cheapest split across the axis, if that is cheaper.
  static void choose(const SlabPlanes& planes, unsigned axis, SplitSide crossing, const SimdBox (&boxes)[kSpatialBins],
                     const std::uint32_t (&low)[kSpatialBins], const std::uint32_t (&high)[kSpatialBins],
                     std::size_t most, SpatialSplit& best) {
    SimdBox right_box[kSpatialBins];
    std::uint32_t right_count[kSpatialBins];
    SimdBox right;
    std::uint32_t count = 0;
    for (int i = kSpatialBins - 1; i > 0; --i) {
      right.add(boxes[i]);
      count += high[i];
      right_box[i] = right;
      right_count[i] = count;
    }
    SimdBox left;
    count = 0;
    for (int i = 1; i < kSpatialBins; ++i) {
      left.add(boxes[i - 1]);
      count += low[i - 1];
      if (count == 0 || right_count[i] == 0 || count + right_count[i] > most) continue;
      const float cost = side_cost(left, count) + side_cost(right_box[i], right_count[i]);
      if (!(cost < best.cost)) continue;
      best = SpatialSplit{cost, axis, planes.plane[axis][i], crossing, left, right_box[i], count, right_count[i]};
    }
  }
};

/// SpatialBins for splits that cut nothing, too.
struct WholeBins : SpatialBins {
  SimdBox begin_box[3][kSpatialBins], end_box[3][kSpatialBins];  ///< Of the references that begin and that end there.

  /// @param whole the reference's box.
  void count(const SimdBox& whole, const SlabSpan (&spans)[3]) {
    SpatialBins::count(whole, spans);
    for (int axis = 0; axis < 3; ++axis) {
      begin_box[axis][spans[axis].begin].add(whole);
      end_box[axis][spans[axis].end].add(whole);
    }
  }
  using SpatialBins::add;
  void add(const WholeBins& other) {
    SpatialBins::add(other);
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < kSpatialBins; ++i) {
        begin_box[axis][i].add(other.begin_box[axis][i]);
        end_box[axis][i].add(other.end_box[axis][i]);
      }
  }
  /// @param share as SplitRules::whole_share.
  SpatialSplit best(const SlabPlanes& planes, std::size_t most, float share) const {
    const SpatialSplit cutting = SpatialBins::best(planes, most);
    SpatialSplit whole;
    for (unsigned axis = 0; axis < 3; ++axis) {
      choose(planes, axis, SplitSide::kLeft, begin_box[axis], begin[axis], begin[axis], most, whole);
      choose(planes, axis, SplitSide::kRight, end_box[axis], end[axis], end[axis], most, whole);
    }
    return whole.cost < share * cutting.cost ? whole : cutting;
  }
};

}  // namespace hiprt::build
