#pragma once
/// Boxes as bytes: the planes of a QuantizedBoxNode lie on a grid per axis.
///
/// A plane is origin + q * scale with q = 0..255 and scale a power of two. Encoding rounds outwards. Every encoded
/// plane is exactly a float, so decoding with one rounding or two gives the same result on every machine.

#include <hiprt_device/format/node.h>

namespace hiprt {

/// The largest magnitude of a plane. So the difference of any two planes is finite, and so is q * scale.
inline constexpr float kQuantizedLimit = 0x1p126f;
inline constexpr std::uint8_t kQuantizedPlaneEnd = 255;

/// Scale of an axis: 2^(exponent - 127). @param exponent 1 to 254.
HIPRT_HD constexpr float quantized_scale(std::uint8_t exponent) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(exponent) << 23);
}

/// The parts of QuantizedBoxNode::children.
HIPRT_HD constexpr std::uint32_t children_mask(std::uint8_t children) { return children & 0xfu; }
HIPRT_HD constexpr unsigned children_order_axis(std::uint8_t children) { return children >> 4 & 3u; }

/// Whether the box has no point; true if a coordinate is NaN.
HIPRT_HD constexpr bool is_empty(const Box& box) {
  return !(box.min[0] <= box.max[0] && box.min[1] <= box.max[1] && box.min[2] <= box.max[2]);
}

namespace quantize_detail {

/// floor(value / scale) for values on a grid of at most 2^24 cells on either side of 0.
HIPRT_HD constexpr std::int32_t cell_below(float value, float scale) {
  // Exact: the divisor is a power of two, and a double's exponent reaches far enough.
  const double cells = static_cast<double>(value) / static_cast<double>(scale);
  const auto whole = static_cast<std::int32_t>(cells);
  return static_cast<double>(whole) > cells ? whole - 1 : whole;
}
HIPRT_HD constexpr std::int32_t cell_above(float value, float scale) { return -cell_below(-value, scale); }

/// Biased exponent of the smallest possible scale.
///
/// The scale is at least the distance between floats of the largest magnitude, so that all planes are floats. It is at
/// least 1/255 of the extent. Rounding outwards may need twice or four times this scale.
HIPRT_HD constexpr std::uint32_t first_exponent(float low, float high) {
  const float magnitude = -low > high ? -low : high;
  const auto magnitude_exponent = static_cast<std::int32_t>(std::bit_cast<std::uint32_t>(magnitude) >> 23 & 0xffu);
  const double step = (static_cast<double>(high) - static_cast<double>(low)) / 255.0;
  const auto step_exponent = static_cast<std::int32_t>(std::bit_cast<std::uint64_t>(step) >> 52) - 1023 + 127;
  const std::int32_t larger = magnitude_exponent - 23 > step_exponent ? magnitude_exponent - 23 : step_exponent;
  return larger > 1 ? static_cast<std::uint32_t>(larger) : 1u;
}

/// Puts the planes of one axis on the grid of scale 2^(exponent - 127).
/// @return whether they fit in 0..255.
HIPRT_HD constexpr bool try_axis(QuantizedBoxNode& node, const Box (&boxes)[kBranching], unsigned axis, float low,
                                 std::uint32_t exponent) {
  const float scale = quantized_scale(static_cast<std::uint8_t>(exponent));
  const std::int32_t first = cell_below(low, scale);
  node.origin[axis] = static_cast<float>(static_cast<double>(first) * static_cast<double>(scale));
  node.exponent[axis] = static_cast<std::uint8_t>(exponent);
  for (unsigned c = 0; c < kBranching; ++c) {
    std::int32_t min = kQuantizedPlaneEnd, max = 0;
    if (!is_empty(boxes[c])) {
      min = cell_below(boxes[c].min[axis], scale) - first;
      max = cell_above(boxes[c].max[axis], scale) - first;
      if (max > kQuantizedPlaneEnd) return false;
    }
    node.plane[axis][0][c] = static_cast<std::uint8_t>(min);
    node.plane[axis][1][c] = static_cast<std::uint8_t>(max);
  }
  return true;
}

HIPRT_HD constexpr bool quantize_axis(QuantizedBoxNode& node, const Box (&boxes)[kBranching], unsigned axis) {
  float low = kQuantizedLimit, high = -kQuantizedLimit;
  for (const Box& box : boxes) {
    if (is_empty(box)) continue;
    if (!(box.min[axis] >= -kQuantizedLimit && box.max[axis] <= kQuantizedLimit)) return false;
    low = box.min[axis] < low ? box.min[axis] : low;
    high = box.max[axis] > high ? box.max[axis] : high;
  }
  if (low > high) low = high = 0.0f;
  for (std::uint32_t exponent = first_exponent(low, high); exponent < 255; ++exponent)
    if (try_axis(node, boxes, axis, low, exponent)) return true;
  return false;
}

}  // namespace quantize_detail

/// Twice the center of a finite box. The rounded sum may overflow to infinity beyond half of the largest float.
HIPRT_HD constexpr float twice_center(const Box& box, unsigned axis) { return box.min[axis] + box.max[axis]; }

/// The axis along which the centers of the boxes that are not empty spread most; the first of equal axes.
HIPRT_HD constexpr unsigned order_axis(const Box (&boxes)[kBranching]) {
  unsigned best = 0;
  float widest = -1.0f;
  for (unsigned axis = 0; axis < 3; ++axis) {
    float low = 2.0f * kQuantizedLimit, high = -low;
    for (const Box& box : boxes) {
      if (is_empty(box)) continue;
      const float center = twice_center(box, axis);
      low = center < low ? center : low;
      high = center > high ? center : high;
    }
    // Halves: the difference of two numbers up to 2^127 must not overflow.
    const float spread = 0.5f * high - 0.5f * low;
    if (!(spread > widest)) continue;
    widest = spread;
    best = axis;
  }
  return best;
}

/// Sets origin, exponent, children and plane. References, flags and reserved stay the same.
/// @param boxes empty where there is no child; otherwise finite with min <= max.
/// @return false if a plane is beyond kQuantizedLimit: the node is then not usable.
HIPRT_HD constexpr bool quantize(QuantizedBoxNode& node, const Box (&boxes)[kBranching]) {
  std::uint32_t present = 0;
  for (unsigned c = 0; c < kBranching; ++c) present |= (is_empty(boxes[c]) ? 0u : 1u) << c;
  node.children = static_cast<std::uint8_t>(present | order_axis(boxes) << 4);
  for (unsigned axis = 0; axis < 3; ++axis)
    if (!quantize_detail::quantize_axis(node, boxes, axis)) return false;
  return true;
}

/// A plane of a child that is present. It is exact, so compilers may fuse multiplication and addition or not.
/// @param side 0 minimum, 1 maximum.
HIPRT_HD constexpr float dequantize(const QuantizedBoxNode& node, unsigned axis, unsigned side, unsigned child) {
  return node.origin[axis] + static_cast<float>(node.plane[axis][side][child]) * quantized_scale(node.exponent[axis]);
}

}  // namespace hiprt
