#pragma once
/// The byte offsets of numbers in node and leaf records, and faults of planes. Internal.

#include <hiprt_build/format/box.h>
#include <hiprt_build/format/check.h>
#include <hiprt_device/format/layout.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace hiprt::format_detail {

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

/// Fails with @p kind: plane @p plane is that of @p here, but that of @p wanted was expected.
/// @param at the byte offset of the plane in the file.
inline Check fail_plane(FormatError kind, std::uint64_t at, unsigned plane, const Box& here, const Box& wanted) {
  return fail_float(kind, at, side_of(here, plane / 3, plane % 3), side_of(wanted, plane / 3, plane % 3));
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
