#pragma once
/// Boxes, coordinates and their places in a record, as validate() needs them.

#include <hiprt_build/format/error.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/format/layout.h>

#include <tl/expected.hpp>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>

namespace hiprt::format_detail {

using Check = tl::expected<void, FormatIssue>;

/// Byte offset of a number within its record. Planes: side * 3 + axis.
constexpr std::uint64_t box_offset(FloatLayout, unsigned child, unsigned plane) {
  return offsetof(FloatBoxNode, box) + sizeof(Box) * child + 4 * plane;
}
constexpr std::uint64_t box_offset(PlanesLayout, unsigned child, unsigned plane) {
  return offsetof(PlanesBoxNode, plane) + 32 * (plane % 3) + 16 * (plane / 3) + 4 * child;
}
constexpr std::uint64_t box_offset(HalfLayout, unsigned child, unsigned plane) {
  return offsetof(HalfBoxNode, box) + sizeof(HalfBoxNode::HalfBox) * child + 2 * plane;
}
constexpr std::uint64_t box_offset(QuantizedLayout, unsigned child, unsigned plane) {
  return offsetof(QuantizedBoxNode, plane) + 8 * (plane % 3) + 4 * (plane / 3) + child;
}
template <class Layout> constexpr std::uint64_t coordinate_offset(unsigned vertex, unsigned axis) {
  if constexpr (std::is_same_v<typename Layout::Leaf, FloatLeaf>)
    return offsetof(FloatLeaf, vertex) + 12 * vertex + 4 * axis;
  else
    return offsetof(PlanesLeaf, coordinate) + 16 * axis + 4 * vertex;
}

/// The words of a node that must be zero.
template <class Node> std::span<const std::uint32_t> reserved_words(const Node& node) { return node.reserved; }
inline std::span<const std::uint32_t> reserved_words(const HalfBoxNode&) { return {}; }
inline std::span<const std::uint32_t> reserved_words(const QuantizedBoxNode& node) { return {&node.reserved, 1}; }

inline std::uint64_t float_bits(float value) { return std::bit_cast<std::uint32_t>(value); }

/// min = +inf, max = -inf: the neutral element of grow(), and the box of an absent child.
HIPRT_HD inline Box empty_box() {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  return {{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
}

HIPRT_HD inline float side_of(const Box& box, unsigned side, unsigned axis) {
  return side == 0 ? box.min[axis] : box.max[axis];
}

HIPRT_HD inline bool is_finite(float x) { return x - x == 0.0f; }

/// Planes of a box are numbered side * 3 + axis (0-5); 6 stands for none.
inline constexpr unsigned kNoPlane = 6;

/// @return the first plane that is not finite, or exceeds its finite opposite.
HIPRT_HD inline unsigned first_bad_plane(const Box& box) {
  for (unsigned plane = 0; plane < 6; ++plane) {
    const bool inverted = box.min[plane % 3] > box.max[plane % 3];
    if (!is_finite(side_of(box, plane / 3, plane % 3)) ||
        (inverted && is_finite(side_of(box, 1 - plane / 3, plane % 3))))
      return plane;
  }
  return kNoPlane;
}

/// The same where min = -inf and max = +inf are allowed.
inline unsigned first_bad_plane_unbounded(Box box) {
  constexpr float kMax = std::numeric_limits<float>::max(), kInfinity = std::numeric_limits<float>::infinity();
  for (unsigned axis = 0; axis < 3; ++axis) {
    if (box.min[axis] == -kInfinity) box.min[axis] = -kMax;
    if (box.max[axis] == kInfinity) box.max[axis] = kMax;
  }
  return first_bad_plane(box);
}

/// @return the first plane in which the boxes differ.
inline unsigned first_different_plane(const Box& a, const Box& b) {
  for (unsigned plane = 0; plane < 6; ++plane)
    if (side_of(a, plane / 3, plane % 3) != side_of(b, plane / 3, plane % 3)) return plane;
  return kNoPlane;
}

/// @return the first plane of @p inner outside @p outer. A NaN is outside.
HIPRT_HD inline unsigned first_plane_outside(const Box& inner, const Box& outer) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    if (!(outer.min[axis] <= inner.min[axis])) return axis;
    if (!(inner.max[axis] <= outer.max[axis])) return 3 + axis;
  }
  return kNoPlane;
}

HIPRT_HD inline void grow(Box& box, const Box& other) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    if (other.min[axis] < box.min[axis]) box.min[axis] = other.min[axis];
    if (other.max[axis] > box.max[axis]) box.max[axis] = other.max[axis];
  }
}

/// @return the common part, or the empty box.
inline Box intersection(const Box& a, const Box& b) {
  Box common{};
  for (unsigned axis = 0; axis < 3; ++axis) {
    common.min[axis] = a.min[axis] < b.min[axis] ? b.min[axis] : a.min[axis];
    common.max[axis] = a.max[axis] < b.max[axis] ? a.max[axis] : b.max[axis];
    if (!(common.min[axis] <= common.max[axis])) return empty_box();
  }
  return common;
}

/// kind, with the plane's bits in @p here and in @p wanted; @p at the byte offset of the plane.
inline Check fail_plane(FormatError kind, std::uint64_t at, unsigned plane, const Box& here, const Box& wanted) {
  return fail(kind, at, float_bits(side_of(here, plane / 3, plane % 3)),
              float_bits(side_of(wanted, plane / 3, plane % 3)));
}

/// Corners of a leaf's triangle in stored order: corner[c][axis].
struct Corners {
  float corner[3][3];
};
template <class Layout> Corners leaf_triangle(const typename Layout::Leaf& leaf, unsigned triangle) {
  Corners corners{};
  for (unsigned c = 0; c < 3; ++c)
    for (unsigned axis = 0; axis < 3; ++axis)
      corners.corner[c][axis] = Layout::coordinate(leaf, corner_vertex(triangle, c), axis);
  return corners;
}

inline Box bounds_of(const Corners& triangle) {
  Box box = empty_box();
  for (const auto& corner : triangle.corner)
    grow(box, Box{{corner[0], corner[1], corner[2]}, {corner[0], corner[1], corner[2]}});
  return box;
}

}  // namespace hiprt::format_detail
