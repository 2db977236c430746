#pragma once
/// A wide node from its children, as builders and refits write it. Internal.

#include <hiprt_build/tree/box.h>
#include <hiprt_device/format/layout.h>

#include <cassert>

namespace hiprt::build {

/// A child of a wide node. The default is an absent child.
struct WideChild {
  NodeRef ref = kInvalidRef;
  std::uint32_t flags = 0;  ///< Child flags.
  Box box = empty_box();    ///< The node must hold this box or a larger one.
};

/// Sorts children by box centre along the axis where they spread most, absent children last. The sort is stable.
/// Readers of quantized nodes profit from this order.
HIPRT_HD HIPRT_FORCE_INLINE void arrange(WideChild (&children)[kBranching]) {
  const Box boxes[kBranching] = {children[0].box, children[1].box, children[2].box, children[3].box};
  const unsigned axis = order_axis(boxes);
  const auto before = [axis](const WideChild& a, const WideChild& b) {
    if (a.ref == kInvalidRef || b.ref == kInvalidRef) return a.ref != kInvalidRef && b.ref == kInvalidRef;
    return twice_center(a.box, axis) < twice_center(b.box, axis);
  };
  for (unsigned i = 1; i < kBranching; ++i)
    for (unsigned k = i; k > 0 && before(children[k], children[k - 1]); --k) {
      const WideChild moved = children[k];
      children[k] = children[k - 1];
      children[k - 1] = moved;
    }
}

/// The boxes of a node as one: of what its bytes decode to.
template <class Layout> HIPRT_HD HIPRT_FORCE_INLINE Box node_box(const typename Layout::Node& node) {
  Box box = empty_box();
  for (unsigned i = 0; i < kBranching; ++i) grow(box, Layout::box(node, i));
  return box;
}

/// What a node of a file with these bounds states for a child.
template <class Layout>
HIPRT_HD HIPRT_FORCE_INLINE Box stated_box(const typename Layout::Node& node, unsigned child, const Box& bounds) {
  const Box box = Layout::box(node, child);
  return Layout::kId == NodeLayout::kHalf ? bounded(box, bounds) : box;
}

[[maybe_unused]] HIPRT_HD constexpr bool contains(const Box& outer, const Box& inner) {
  for (unsigned axis = 0; axis < 3; ++axis)
    if (!(outer.min[axis] <= inner.min[axis] && inner.max[axis] <= outer.max[axis])) return false;
  return true;
}

/// Debug builds on a host stop where the encoding does not hold a box.
HIPRT_HD HIPRT_FORCE_INLINE void check_encoding([[maybe_unused]] bool holds) {
#if !HIPRT_DEVICE_CODE
  assert(holds);
#endif
}

/// @param children in any slots, at least one; rearranged for layout quantized. Layout quantized: within
/// kQuantizedLimit.
template <class Layout> HIPRT_HD HIPRT_FORCE_INLINE typename Layout::Node make_node(WideChild (&children)[kBranching]) {
  if constexpr (Layout::kId == NodeLayout::kQuantized) arrange(children);
  typename Layout::Node node{};
  std::uint32_t flags = 0;
  for (unsigned i = 0; i < kBranching; ++i) {
    node.child[i] = children[i].ref;
    flags |= children[i].flags << (8 * i);
  }
  Layout::set_child_flags(node, flags);
  const Box boxes[kBranching] = {children[0].box, children[1].box, children[2].box, children[3].box};
  [[maybe_unused]] const bool encoded = Layout::set_boxes(node, boxes);
  check_encoding(encoded);
  for (unsigned i = 0; i < kBranching; ++i)
    check_encoding(children[i].ref == kInvalidRef || contains(Layout::box(node, i), boxes[i]));
  return node;
}

}  // namespace hiprt::build
