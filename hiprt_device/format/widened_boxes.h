#pragma once
/// Boxes that are wider than their content, for box tests that cannot widen them: AMD's ray instruction.
///
/// Decision: docs/decisions/0008-amd-ray-instruction.md. Constants: docs/proofs/ray-instruction.md.

#include <hiprt_device/format/node.h>

namespace hiprt {

/// By how much boxes must exceed their content for one ray.
/// @param reach largest distance along an axis from the ray's origin to a side of the scene's bounds.
/// @param magnitude largest coordinate of the bounds plus the largest of the origin.
HIPRT_HD constexpr float needed_box_margin(float reach, float magnitude) {
  return 0x1p-24f * (28.0f * reach + 8.0f * magnitude);
}

/// Whether a builder can widen the boxes of this layout: the ray instruction reads no other.
HIPRT_HD constexpr bool may_be_widened(NodeLayout layout) {
  return layout == NodeLayout::kFloat || layout == NodeLayout::kHalf;
}

namespace widened_detail {

/// Rays from farther away than this many times the longest side of the scene take a box test in software.
inline constexpr float kFarthestSides = 2.0f;

HIPRT_HD constexpr float larger_of(float a, float b) { return a < b ? b : a; }

}  // namespace widened_detail

/// The margin that a builder gives the boxes of a scene.
/// @return 0 if the bounds are empty, or too large or too small for a margin.
HIPRT_HD constexpr float box_margin_of(const Box& bounds) {
  using widened_detail::larger_of, widened_detail::kFarthestSides;
  float side = 0.0f, magnitude = 0.0f;
  for (unsigned axis = 0; axis < 3; ++axis) {
    if (!(bounds.min[axis] <= bounds.max[axis])) return 0.0f;
    side = larger_of(side, bounds.max[axis] - bounds.min[axis]);
    magnitude = larger_of(magnitude, larger_of(bounds.max[axis], -bounds.min[axis]));
  }
  const float margin = needed_box_margin((1.0f + kFarthestSides) * side, 2.0f * magnitude + kFarthestSides * side);
  // The range of the guarantees (ray.h).
  return margin >= 0x1p-124f && margin <= 0x1p60f ? margin : 0.0f;
}

/// An empty box stays empty.
HIPRT_HD constexpr Box widened(const Box& box, float margin) {
  return {{box.min[0] - margin, box.min[1] - margin, box.min[2] - margin},
          {box.max[0] + margin, box.max[1] + margin, box.max[2] + margin}};
}

}  // namespace hiprt
