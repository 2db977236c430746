#pragma once
/// Where references are split before a tree is built over them, and how often (Karras and Aila, "Fast parallel
/// construction of high-quality bounding volume hierarchies", 2013, section 3.4). Internal.

#include <hiprt_build/presplit/clip.h>
#include <hiprt_device/math/wave.h>

#include <bit>
#include <cstdint>

namespace hiprt::build {

/// Splits of one reference: keeps hostile scenes from spending everything on one triangle.
inline constexpr std::uint32_t kMaxSplits = 1u << 16;

/// Of the bits of the largest scale (find_scale()).
inline constexpr unsigned kScalePrecision = 12;

/// Planes that halve a cube around the scene, its halves, and so on.
class SplitPlanes {
 public:
  static constexpr unsigned kBits = 21;

  struct Plane {
    unsigned axis;
    float position;
  };

  HIPRT_HD explicit SplitPlanes(const Box& scene) : low_{scene.min[0], scene.min[1], scene.min[2]} {
    const float longest = longest_edge(scene);
    if (longest > 0x1p-100f && longest < SimdBox::kInfinity) {
      cells_per_unit_ = static_cast<float>(1u << kBits) / longest;
      unit_ = longest / static_cast<float>(1u << kBits);
    }
  }

  HIPRT_HD HIPRT_FORCE_INLINE static float longest_edge(const Box& box) {
    float longest = box.max[0] - box.min[0];
    for (unsigned axis = 1; axis < 3; ++axis) {
      const float edge = box.max[axis] - box.min[axis];
      longest = edge > longest ? edge : longest;
    }
    return longest;
  }

  /// How coarse the coarsest plane through a box is: kBits for the one that halves the scene, 0 for none.
  HIPRT_HD unsigned coarseness(const Box& box) const {
    unsigned best = 0;
    for (unsigned axis = 0; axis < 3; ++axis) {
      const unsigned here = coarseness(box, axis);
      best = here > best ? here : best;
    }
    return best;
  }

  /// The coarsest plane through a box, of equal ones that across its longest edge; the middle of that where the grid is
  /// too coarse. The plane may lie on the border of the box only if the box is too small to be halved.
  HIPRT_HD Plane through(const Box& box) const {
    Plane best{0, 0.0f};
    unsigned coarsest = 0;
    float low = 0.0f, high = 0.0f, plane_low = 0.0f;
    for (unsigned axis = 0; axis < 3; ++axis) {
      const unsigned here = coarseness(box, axis);
      const bool longer = box.max[axis] - box.min[axis] > high - low;
      if (axis != 0 && (here < coarsest || (here == coarsest && !longer))) continue;
      coarsest = here;
      best.axis = axis;
      low = box.min[axis];
      high = box.max[axis];
      plane_low = low_[axis];
    }
    if (coarsest > 0) {
      const std::uint32_t plane = cell(high, plane_low) >> (coarsest - 1) << (coarsest - 1);
      best.position = plane_low + static_cast<float>(plane) * unit_;
      if (best.position > low && best.position < high) return best;
    }
    best.position = 0.5f * low + 0.5f * high;
    return best;
  }

 private:
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t cell(float x, float low) const {
    const float position = (x - low) * cells_per_unit_;
    // No number where the scene's extent overflows: there is no grid then.
    if (!(position > 0.0f)) return 0;
    constexpr auto kLast = static_cast<float>((1u << kBits) - 1);
    return static_cast<std::uint32_t>(position < kLast ? position : kLast);
  }
  HIPRT_HD HIPRT_FORCE_INLINE unsigned coarseness(const Box& box, unsigned axis) const {
    const std::uint32_t differ = cell(box.min[axis], low_[axis]) ^ cell(box.max[axis], low_[axis]);
    return differ == 0 ? 0 : highest_bit(std::uint64_t{differ}) + 1;
  }

  float low_[3];
  float cells_per_unit_ = 0.0f, unit_ = 0.0f;
};

namespace presplit_detail {

/// A box of up to so many times a triangle's own area is filled well enough. (1 in the paper. A right triangle along
/// the axes has 2 and gains little from cuts. SAH costs with 1, 2, 3 and 5: decision 0011.)
inline constexpr float kFilled = 3.0f;

/// least_area() of one triangle.
HIPRT_HD HIPRT_FORCE_INLINE float least_area(const Point& a, const Point& b, const Point& c) {
  float sum = 0.0f;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const unsigned k = (axis + 1) % 3, m = (axis + 2) % 3;
    const float area = (b.x[k] - a.x[k]) * (c.x[m] - a.x[m]) - (b.x[m] - a.x[m]) * (c.x[k] - a.x[k]);
    sum += area < 0.0f ? -area : area;
  }
  return 0.5f * sum;
}

/// The same on all processors. @param x positive and finite.
HIPRT_HD HIPRT_FORCE_INLINE float cube_root(float x) {
  const auto wanted = static_cast<double>(x);
  // A third of the exponent: within 6 % of the root of a normal double, and each step squares the error.
  double root = std::bit_cast<double>(std::bit_cast<std::uint64_t>(wanted) / 3 + 0x2a9f789300000000ull);
  for (unsigned step = 0; step < 4; ++step) root -= (root - wanted / (root * root)) / 3.0;
  return static_cast<float>(root);
}

/// 2^-n. @param n up to 126.
HIPRT_HD HIPRT_FORCE_INLINE float negative_power(unsigned n) { return std::bit_cast<float>((127u - n) << 23); }

}  // namespace presplit_detail

/// The limit of the area of boxes around ever smaller parts of a leaf's triangles, as half_area().
HIPRT_HD HIPRT_FORCE_INLINE float least_area(const LeafCorners& corners, bool pair) {
  const Point(&v)[4] = corners.v;
  return presplit_detail::least_area(v[0], v[1], v[2]) + (pair ? presplit_detail::least_area(v[1], v[3], v[2]) : 0.0f);
}

/// In proportion to the splits that a reference should have.
/// @param box of the reference. @param corners,pair its triangles.
HIPRT_HD HIPRT_FORCE_INLINE float split_weight(const SplitPlanes& planes, const Box& box, const LeafCorners& corners,
                                               bool pair) {
  using namespace presplit_detail;
  const unsigned coarse = planes.coarseness(box);
  const float empty = half_area(box) - kFilled * least_area(corners, pair);
  if (coarse == 0 || !(empty > 0.0f) || !(empty < SimdBox::kInfinity)) return 0.0f;
  const float part = empty * negative_power(SplitPlanes::kBits - coarse);
  return part > 0.0f ? cube_root(part) : 0.0f;
}

/// How often a reference is split.
HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t split_count(float weight, float scale) {
  const float wanted = weight * scale;
  return wanted < static_cast<float>(kMaxSplits) ? static_cast<std::uint32_t>(wanted) : kMaxSplits;
}

/// The largest scale with which no more than so many splits are made in all, nearly: found by halving. (Positive floats
/// order as their bits do.)
struct ScaleSearch {
  std::uint32_t good = 0, bad = 0x7f800000u;  ///< Bits of scales.

  HIPRT_HD bool done() const { return bad - good <= 1u << kScalePrecision; }
  HIPRT_HD std::uint32_t middle() const { return good + (bad - good) / 2; }
  /// The scale to try.
  HIPRT_HD float next() const { return std::bit_cast<float>(middle()); }
  HIPRT_HD void tried(bool fits) { (fits ? good : bad) = middle(); }
  HIPRT_HD float result() const { return std::bit_cast<float>(good); }
};

/// Step: splits the part at a slot once. A reference owns as many slots as it may have parts. The left part stays in
/// its slot and keeps the slots that its own splits need. The right part goes behind them. So the parts lie in
/// depth-first order, left before right.
/// @tparam Parts has Box box(slot), LeafCorners corners(slot) and bool is_pair(slot). put(slot, from, box) copies the
/// part at @p from to @p slot, with another box. splits(slot) and set_splits(slot, count) hold the splits still to be
/// made.
template <class Parts> struct PresplitStep {
  SplitPlanes planes;
  Parts parts;

  /// @return whether there was a split: there may be more to do at @p slot, and behind.
  HIPRT_HD bool operator()(std::uint32_t slot) const {
    const std::uint32_t wanted = parts.splits(slot);
    if (wanted == 0) return false;
    const Box box = parts.box(slot);
    const SplitPlanes::Plane plane = planes.through(box);
    const float low = plane.axis == 0 ? box.min[0] : plane.axis == 1 ? box.min[1] : box.min[2];
    const float high = plane.axis == 0 ? box.max[0] : plane.axis == 1 ? box.max[1] : box.max[2];
    parts.set_splits(slot, 0);
    if (!(plane.position > low && plane.position < high)) return false;
    const SplitBounds halves =
        split_bounds(parts.corners(slot), parts.is_pair(slot), to_simd(box), plane.axis, plane.position);
    const Box left_box = to_box(halves.left), right_box = to_box(halves.right);
    const float left = SplitPlanes::longest_edge(left_box), right = SplitPlanes::longest_edge(right_box);
    const float share = left + right > 0.0f ? left / (left + right) : 0.5f;
    const std::uint32_t rest = wanted - 1;
    const float wanted_left = static_cast<float>(rest) * share;
    auto to_left = static_cast<std::uint32_t>(wanted_left);
    if (to_left < rest && wanted_left - static_cast<float>(to_left) >= 0.5f) ++to_left;
    const std::uint32_t right_slot = slot + to_left + 1;
    parts.put(right_slot, slot, right_box);
    parts.set_splits(right_slot, rest - to_left);
    parts.put(slot, slot, left_box);
    parts.set_splits(slot, to_left);
    return true;
  }
};

}  // namespace hiprt::build
