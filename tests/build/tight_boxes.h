#pragma once
/// Checks node by node that the boxes of a file are as small as its layout allows.

#include <hiprt_build/format/box.h>
#include <hiprt_build/format/record_checks.h>
#include <hiprt_build/format/view.h>

#include <tests/catch.h>
#include <tests/oracle/nodes_of.h>

#include <cmath>

namespace hiprt::test {

/// The content of a node's boxes: the boxes decoded from the child, or the primitives of the run.
template <class Layout> class Contents {
 public:
  explicit Contents(const BufferView& view)
      : view_(view),
        nodes_(oracle::nodes_of<typename Layout::Node>(view)),
        leaves_(view.records<typename Layout::Leaf>(view.leaves)) {}

  Box below(NodeRef ref) const {
    Box box = format_detail::empty_box();
    if (ref == kInvalidRef) return box;
    if (is_box(ref)) {
      for (unsigned c = 0; c < kBranching; ++c) format_detail::grow(box, Layout::box(node(ref), c));
      return box;
    }
    for (std::size_t i = (ref_offset(ref) - view_.leaves.offset) / sizeof(typename Layout::Leaf);; ++i) {
      for (unsigned k = 0; k < 2; ++k)
        format_detail::grow(box, ref_type(ref) == NodeType::kProcedural
                                     ? custom_leaf(leaves_[i]).box[k]
                                     : bounds_of(format_detail::leaf_triangle<Layout>(leaves_[i], k)));
      if ((leaves_[i].info.geometry_and_flags & kLastInRun) != 0) return box;
    }
  }
  const std::vector<typename Layout::Node>& nodes() const { return nodes_; }

 private:
  const typename Layout::Node& node(NodeRef ref) const { return nodes_[view_.node_number(ref)]; }

  const BufferView& view_;
  std::vector<typename Layout::Node> nodes_;
  std::span<const typename Layout::Leaf> leaves_;
};

/// The half one further out. @param up towards +infinity. Infinity stays.
inline float further(float value, bool up) {
  const std::uint16_t half = half_below(value);
  if (half == (up ? kHalfInfinity : kHalfNegativeInfinity)) return value;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  return up ? half_to_float(half_above(std::nextafter(value, kInfinity)))
            : half_to_float(half_below(std::nextafter(value, -kInfinity)));
}

/// Whether a stated plane is outside of its content by less than one step of the encoding.
template <class Layout>
bool is_tight(const typename Layout::Node& node, unsigned axis, unsigned side, float stated, float content) {
  const double outside = side == 0 ? static_cast<double>(content) - static_cast<double>(stated)
                                   : static_cast<double>(stated) - static_cast<double>(content);
  if constexpr (Layout::kId == NodeLayout::kQuantized)
    return outside >= 0 && outside < quantized_scale(node.exponent[axis]);
  if constexpr (Layout::kId == NodeLayout::kHalf)
    return stated == content || (side == 0 ? stated < content && further(stated, true) > content
                                           : stated > content && further(stated, false) < content);
  return outside == 0;
}

/// @pre no split references: the file does not tell which part of a triangle their leaves hold.
template <class Layout> void check_tight_boxes(const BufferView& view) {
  const Contents<Layout> contents(view);
  unsigned loose = 0, unordered = 0;
  for (const auto& node : contents.nodes()) {
    Box boxes[kBranching];
    for (unsigned c = 0; c < kBranching; ++c) {
      boxes[c] = contents.below(node.child[c]);
      if (node.child[c] == kInvalidRef) continue;
      const Box stated = Layout::box(node, c);
      for (unsigned axis = 0; axis < 3; ++axis) {
        loose += is_tight<Layout>(node, axis, 0, stated.min[axis], boxes[c].min[axis]) ? 0 : 1;
        loose += is_tight<Layout>(node, axis, 1, stated.max[axis], boxes[c].max[axis]) ? 0 : 1;
      }
    }
    if constexpr (Layout::kId == NodeLayout::kQuantized) {
      const unsigned axis = children_order_axis(node.children);
      CHECK(axis == order_axis(boxes));
      for (unsigned c = 1; c < kBranching; ++c)
        if (node.child[c] != kInvalidRef)
          unordered +=
              node.child[c - 1] != kInvalidRef && twice_center(boxes[c - 1], axis) <= twice_center(boxes[c], axis) ? 0
                                                                                                                   : 1;
    }
  }
  CHECK(loose == 0);
  CHECK(unordered == 0);
}

inline void check_tight_boxes(const BufferView& view) {
  dispatch_layout(view.layout(), [&](auto layout) { check_tight_boxes<decltype(layout)>(view); });
}

}  // namespace hiprt::test
