#pragma once
/// Splits a leaf's triangles between the imported leaves that contain them. Internal.

#include <hiprt_build/presplit/clip.h>
#include <hiprt_build/tree/box.h>

#include <algorithm>
#include <span>
#include <vector>

namespace hiprt::build {

/// Splits a reference between leaves by planes that separate the leaves' boxes. The parts always cover the reference:
/// every split keeps both sides, and an unsuitable plane only makes boxes larger.
/// @tparam Leaves has const Box& operator()(std::uint32_t leaf) const.
template <class Leaves> class TriangleSplitter {
 public:
  TriangleSplitter(const GeometryTable& geometries, const Leaves& boxes) : geometries_(geometries), boxes_(boxes) {}

  /// Calls emit(box of the part, leaf) once for each leaf that gets a part.
  /// @param leaves at least one; reordered.
  template <class Emit> void operator()(const Reference& reference, std::span<std::uint32_t> leaves, const Emit& emit) {
    split(reference, reference.box, leaves, kMaxSplits, emit);
  }

 private:
  /// The most splits on one path of the recursion. More splits do not improve the boxes, and hostile input could need
  /// one per leaf.
  static constexpr unsigned kMaxSplits = 40;
  /// The leaves on the two sides of a plane may overlap by this part of the smaller side. They also hold whole
  /// primitives, and their boxes may be rounded (decision 0011).
  static constexpr float kMostOverlap = 0.25f;

  struct Plane {
    float overlap = 2 * kMostOverlap;
    std::size_t left = 0;  ///< Leaves on the left; 0: there is no plane.
    unsigned axis = 0;
    float position = 0;

    bool better_than(const Plane& other, std::size_t count) const {
      if (overlap != other.overlap) return overlap < other.overlap;
      return std::min(left, count - left) > std::min(other.left, count - other.left);
    }
  };

  template <class Emit>
  void split(const Reference& reference, const Box& part, std::span<std::uint32_t> leaves, unsigned splits,
             const Emit& emit) {
    const Plane plane = leaves.size() == 1 || splits == 0 ? Plane{} : find_plane(part, leaves);
    if (plane.left == 0) return emit(part, nearest(part, leaves));
    sort(leaves, plane.axis);
    const auto left = leaves.first(plane.left), right = leaves.subspan(plane.left);
    const SplitBounds parts = split_bounds(geometries_, reference, to_simd(part), plane.axis, plane.position);
    split(reference, to_box(parts.left), left, splits - 1, emit);
    split(reference, to_box(parts.right), right, splits - 1, emit);
  }

  void sort(std::span<std::uint32_t> leaves, unsigned axis) const {
    std::sort(leaves.begin(), leaves.end(), [&](std::uint32_t a, std::uint32_t b) {
      const float x = boxes_(a).min[axis], y = boxes_(b).min[axis];
      return x != y ? x < y : a < b;
    });
  }

  /// The plane passes through the inside of the part. A flat part may lie in a plane that touches the boxes of all
  /// leaves.
  Plane find_plane(const Box& part, std::span<std::uint32_t> leaves) {
    Plane best;
    for (unsigned axis = 0; axis < 3; ++axis) {
      sort(leaves, axis);
      const std::size_t count = leaves.size();
      right_max_.resize(count);
      float right_max = boxes_(leaves[count - 1]).max[axis];
      for (std::size_t i = count; i-- > 0;)
        right_max_[i] = right_max = std::max(right_max, boxes_(leaves[i]).max[axis]);
      const float left_min = boxes_(leaves[0]).min[axis];
      float left_max = boxes_(leaves[0]).max[axis];
      for (std::size_t i = 1; i < count; ++i) {
        const float right_min = boxes_(leaves[i]).min[axis];
        const float smaller = std::min(left_max - left_min, right_max_[i] - right_min);
        const float overlap = left_max > right_min ? (left_max - right_min) / smaller : 0.0f;
        const Plane here{overlap, i, axis, 0.5f * left_max + 0.5f * right_min};
        const bool inside = part.min[axis] < here.position && here.position < part.max[axis];
        if (inside && overlap <= kMostOverlap && here.better_than(best, count)) best = here;
        left_max = std::max(left_max, boxes_(leaves[i]).max[axis]);
      }
    }
    return best;
  }

  /// @return the leaf whose box the part enlarges least; of equal leaves, and where areas overflow, the lower one.
  std::uint32_t nearest(const Box& part, std::span<const std::uint32_t> leaves) const {
    std::uint32_t best = leaves[0];
    float least = std::numeric_limits<float>::infinity();
    for (const std::uint32_t leaf : leaves) {
      const float here = half_area(unite(boxes_(leaf), part)) - half_area(boxes_(leaf));
      if (!(here < least) && !(here == least && leaf < best)) continue;
      least = here;
      best = leaf;
    }
    return best;
  }

  const GeometryTable& geometries_;
  Leaves boxes_;
  std::vector<float> right_max_;  ///< [i]: largest upper plane of the leaves from i on.
};

}  // namespace hiprt::build
