#pragma once
/// Lower bounds of the squared distances of a node's four boxes from a point.
///
/// docs/proofs/closest-points.md: no box that has a nearer point is left out.

#include <hiprt_device/intersect/box_test.h>
#include <hiprt_device/math/affine.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The planes of one axis in scene units. Planes of quantized nodes are floats, so they are exact.
template <class Lanes> struct ScenePlanes {
  template <class Node> HIPRT_HD HIPRT_FORCE_INLINE explicit ScenePlanes(const Node&) {}
  template <class Node>
  HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Float operator()(const Node& node, unsigned axis, unsigned side) const {
    return load_planes<Lanes>(node, axis, side);
  }
};
template <class Lanes> struct GridPlanes {
  Words grid;
  HIPRT_HD HIPRT_FORCE_INLINE explicit GridPlanes(const QuantizedBoxNode& node) : grid(load_words(node.origin)) {}
  HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Float operator()(const QuantizedBoxNode& node, unsigned axis,
                                                               unsigned side) const {
    const std::uint32_t bits = axis == 0   ? grid.word[3] << 23 & 0x7f800000u
                               : axis == 1 ? grid.word[3] << 15 & 0x7f800000u
                                           : grid.word[3] << 7 & 0x7f800000u;
    typename Lanes::Float cells = load_planes<Lanes>(node, axis, side);
    if constexpr (Lanes::kByteBias != 0.0f) cells = Lanes::sub(cells, Lanes::all(Lanes::kByteBias));
    return Lanes::fma(cells, Lanes::all(std::bit_cast<float>(bits)), Lanes::all(grid.as_float(axis)));
  }
};
template <class Lanes, class Node>
using PlanesOf = std::conditional_t<std::is_same_v<Node, QuantizedBoxNode>, GridPlanes<Lanes>, ScenePlanes<Lanes>>;

/// The children that exist: absent ones have the empty box, or no bit.
template <class Lanes, class Node>
HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t existing(const Node& node, const typename Lanes::Float& low,
                                                   const typename Lanes::Float& high) {
  return Lanes::less_equal(low, high) & load_present(node);
}

/// A box around a point: the point as it was rounded, with a margin.
template <class Lanes> struct PointBox {
  typename Lanes::Uniform low[3], high[3];

  PointBox() = default;
  /// @param margin in scene units, 0 or more.
  HIPRT_HD HIPRT_FORCE_INLINE PointBox(const Vec3D& point, double margin) {
    const auto set = [&](unsigned axis, double x) {
      low[axis] = Lanes::uniform(affine_detail::round_down(x - margin));
      high[axis] = Lanes::uniform(affine_detail::round_up(x + margin));
    };
    set(0, point.x);
    set(1, point.y);
    set(2, point.z);
  }
};

/// Larger squared distances of boxes count as this one.
inline constexpr float kLargestSquared = std::numeric_limits<float>::max();

/// A float limit for squared distances that were computed in float: at least @p squared with their rounding.
///
/// A difference, a square and three sums have a relative error of 5 units of 2^-24. Below the normal numbers each of
/// the three squares is off by at most half of 2^-149. Beyond the largest float, boxes are not told apart.
HIPRT_HD HIPRT_FORCE_INLINE float squared_limit(double squared) {
  const double limit = fused_multiply_add(squared, 1.0 + 0x1p-21, 0x1p-147);
  return limit <= static_cast<double>(kLargestSquared) ? affine_detail::round_up(limit) : kLargestSquared;
}

/// Children whose boxes may be within a squared distance of the point. BoxHits::enter has the squared distances.
///
/// None is infinite: orders take an infinite distance for that of a child that was not met.
template <class Lanes, class Node>
HIPRT_HD HIPRT_FORCE_INLINE BoxHits<Lanes> near_boxes(const Node& node, const PointBox<Lanes>& point, float limit) {
  const PlanesOf<Lanes, Node> planes(node);
  const auto zero = Lanes::all(0.0f);
  const auto gap = [&](unsigned axis, const typename Lanes::Float& low, const typename Lanes::Float& high)
                       HIPRT_FORCE_INLINE_LAMBDA {
                         const auto below = Lanes::sub(low, Lanes::all(Lanes::value(point.high[axis])));
                         const auto above = Lanes::sub(Lanes::all(Lanes::value(point.low[axis])), high);
                         return Lanes::max(Lanes::max(below, above), zero);
                       };
  const auto low = planes(node, 0, 0), high = planes(node, 0, 1);
  const auto x = gap(0, low, high);
  const auto y = gap(1, planes(node, 1, 0), planes(node, 1, 1)), z = gap(2, planes(node, 2, 0), planes(node, 2, 1));
  const auto sum = Lanes::madd(x, x, Lanes::madd(y, y, Lanes::mul(z, z)));
  const auto squared = Lanes::min(sum, Lanes::all(kLargestSquared));
  return {squared, Lanes::all(limit), existing<Lanes>(node, low, high)};
}

/// Whether a box is certainly farther from the point. The rounding is that of near_boxes().
template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE bool is_farther(const Box& box, const PointBox<Lanes>& point, float limit) {
  const auto gap = [&](unsigned axis) HIPRT_FORCE_INLINE_LAMBDA {
    const float below = box.min[axis] - Lanes::value(point.high[axis]);
    const float above = Lanes::value(point.low[axis]) - box.max[axis];
    return max_of(max_of(below, above), 0.0f);
  };
  const float x = gap(0), y = gap(1), z = gap(2);
  const float squared = fused_multiply_add(x, x, fused_multiply_add(y, y, z * z));
  return limit < kLargestSquared && squared > limit;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
