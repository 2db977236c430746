#pragma once
/// The checks of a quantized node before its planes are decoded. Host only.

#include <hiprt_build/format/record_checks.h>
#include <hiprt_device/math/arithmetic.h>

#include <cmath>
#include <cstdint>

namespace hiprt::format_detail {

/// Whether origin + q * scale is a float within the limit.
/// @param origin within kQuantizedLimit.
/// @param scale a power of two.
inline bool is_exact_plane(float origin, std::uint8_t q, float scale) {
  const double start = origin, offset = q * static_cast<double>(scale), sum = start + offset;
  if (!(std::abs(sum) <= static_cast<double>(kQuantizedLimit))) return false;
  // sum may be rounded, and is rounded again here. The result is exact iff its difference from the larger addend is
  // the other addend. That difference of floats of similar size has no error. (The other difference may have one, but
  // not if everything is exact.)
  const double plane = static_cast<double>(nearest_float(sum));
  return plane - start == offset && plane - offset == start;
}

/// Checks the children byte against the references.
inline Check check_child_slots(const QuantizedBoxNode& node, std::uint64_t node_at) {
  const std::uint64_t at = node_at + offsetof(QuantizedBoxNode, children);
  if ((node.children & 0xc0u) != 0) return fail(FormatError::kBadReservedField, at, node.children, 0x3f);
  std::uint32_t present = 0;
  for (unsigned c = 0; c < kBranching; ++c)
    if (node.child[c] != kInvalidRef) present |= 1u << c;
  if (children_mask(node.children) != present) return fail(FormatError::kBadChildSlots, at, node.children, present);
  if (children_order_axis(node.children) > 2) return fail(FormatError::kBadChildSlots, at, node.children, 0x2f);
  return {};
}

/// Checks origin, scale and planes of one axis.
inline Check check_grid(const QuantizedBoxNode& node, unsigned axis, std::uint64_t node_at) {
  const float origin = node.origin[axis];
  const std::uint32_t exponent = node.exponent[axis];
  if (!(std::abs(origin) <= kQuantizedLimit))
    return fail_float(FormatError::kBadGrid, node_at + 4 * axis, origin, kQuantizedLimit);
  if (exponent < 1 || exponent > 254)
    return fail(FormatError::kBadGrid, node_at + offsetof(QuantizedBoxNode, exponent) + axis, exponent, 254);
  for (unsigned side = 0; side < 2; ++side)
    for (unsigned c = 0; c < kBranching; ++c) {
      const std::uint8_t q = node.plane[axis][side][c];
      const std::uint64_t at = node_at + box_offset(QuantizedLayout{}, c, 3 * side + axis);
      if (node.child[c] == kInvalidRef) {
        const std::uint8_t empty = side == 0 ? kQuantizedPlaneEnd : 0;
        if (q != empty) return fail(FormatError::kBadBox, at, q, empty);
      } else if (!is_exact_plane(origin, q, quantized_scale(node.exponent[axis]))) {
        return fail(FormatError::kInexactPlane, at, q, 0);
      }
    }
  return {};
}

inline Check check_encoding(const QuantizedBoxNode& node, std::uint64_t node_at) {
  if (auto slots = check_child_slots(node, node_at); !slots) return slots;
  for (unsigned axis = 0; axis < 3; ++axis)
    if (auto grid = check_grid(node, axis, node_at); !grid) return grid;
  return {};
}

/// The planes of other layouts are always floats.
template <class Node> Check check_encoding(const Node&, std::uint64_t) { return {}; }

}  // namespace hiprt::format_detail
