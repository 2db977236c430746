#pragma once
/// Moves primitives of a BVH file and fits its boxes.

#include "../format/test_scene.h"
#include "random.h"

#include <hiprt_build/format/box.h>
#include <hiprt_build/format/record_checks.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/format/layout.h>

namespace hiprt::fuzz {

/// Moves vertices and custom primitives, then makes every box, from the last node to the first, the bounds of its
/// content.
template <class Layout> class Refit {
 public:
  /// @param leaf_boxes of the leaves, in place of the boxes of what is in them. Empty: none.
  Refit(test::TestFile& file, const BufferView& view, std::span<const Box> leaf_boxes = {})
      : file_(file),
        view_(view),
        leaf_boxes_(leaf_boxes),
        nodes_(file.data() + view.nodes.offset, view.node_places()),
        leaves_(reinterpret_cast<typename Layout::Leaf*>(file.data() + view.leaves.offset)) {}

  void move_primitives(Random& random) {
    if (view_.leaves.count == 0) return;
    for (std::uint64_t moves = 1 + random.below(4); moves > 0; --moves) {
      const std::uint64_t leaf = random.below(view_.leaves.count);
      is_custom(leaves_[leaf]) ? move_box(leaf, random) : move_vertex(leaves_[leaf], random);
    }
  }

  void fit() {
    Box bounds = view_.header->bounds, primitives = format_detail::empty_box();
    for (std::uint64_t i = view_.node_count(); i-- > 0;) {
      Box boxes[kBranching];
      for (unsigned c = 0; c < kBranching; ++c) boxes[c] = content(nodes_[i].child[c], primitives);
      // validate() refuses values that a layout cannot hold.
      Layout::set_boxes(nodes_[i], boxes);
      bounds = union_of(nodes_[i]);
    }
    if (view_.node_count() == 0) bounds = content(view_.header->root, primitives);
    if (Layout::kId == NodeLayout::kHalf) bounds = bounded(bounds, primitives);
    file_.put(offsetof(FileHeader, bounds), bounds);
  }

 private:
  bool is_custom(const typename Layout::Leaf& leaf) const {
    const std::uint32_t geometry = leaf.info.geometry_and_flags & kGeometryMask;
    return geometry < view_.geometries.size() && (view_.geometries[geometry].flags & kGeometryCustom) != 0;
  }

  void move_vertex(typename Layout::Leaf& leaf, Random& random) const {
    const auto vertex = static_cast<unsigned>(random.below(4)), axis = static_cast<unsigned>(random.below(3));
    Layout::set_coordinate(leaf, vertex, axis, random.wild());
    if (leaf.info.primitive[1] == kInvalidId)
      for (unsigned k = 0; k < 3; ++k) Layout::set_coordinate(leaf, 3, k, Layout::coordinate(leaf, 2, k));
  }

  /// Stretches a custom primitive's box to a wild coordinate.
  void move_box(std::uint64_t leaf, Random& random) {
    const std::uint64_t at = view_.leaves.offset + leaf * sizeof(CustomLeaf);
    auto custom = file_.get<CustomLeaf>(at);
    Box& box = custom.box[custom.info.primitive[1] == kInvalidId ? 0 : random.below(2)];
    const auto axis = static_cast<unsigned>(random.below(3));
    const float to = random.wild();
    if (to < box.min[axis])
      box.min[axis] = to;
    else
      box.max[axis] = to;
    file_.put(at, custom);
  }

  static Box union_of(const typename Layout::Node& node) {
    Box box = format_detail::empty_box();
    for (unsigned c = 0; c < kBranching; ++c) format_detail::grow(box, Layout::box(node, c));
    return box;
  }

  /// Of what a reference names, if it names anything; of a box node, the boxes in it.
  /// @param primitives grows by the primitives of a run.
  Box content(NodeRef ref, Box& primitives) const {
    Box box = format_detail::empty_box();
    const SectionEntry& section = is_box(ref) ? view_.nodes : view_.leaves;
    const std::uint64_t first = (ref_offset(ref) - section.offset) / section.stride;
    if (ref == kInvalidRef || ref_offset(ref) < section.offset || first >= section.count) return box;
    if (is_box(ref)) return union_of(nodes_[first]);
    for (std::uint64_t leaf = first; leaf < section.count; ++leaf) {
      for (unsigned which = 0; which < 2 && leaf_boxes_.empty(); ++which)
        format_detail::grow(box, ref_type(ref) == NodeType::kProcedural
                                     ? custom_leaf(leaves_[leaf]).box[which]
                                     : bounds_of(format_detail::leaf_triangle<Layout>(leaves_[leaf], which)));
      if (!leaf_boxes_.empty()) format_detail::grow(box, leaf_boxes_[leaf]);
      if ((leaves_[leaf].info.geometry_and_flags & kLastInRun) != 0) break;
    }
    format_detail::grow(primitives, box);
    return box;
  }

  test::TestFile& file_;
  const BufferView& view_;
  std::span<const Box> leaf_boxes_;
  NodeArray<typename Layout::Node> nodes_;
  typename Layout::Leaf* leaves_;
};

}  // namespace hiprt::fuzz
