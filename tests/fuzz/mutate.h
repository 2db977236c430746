#pragma once
/// Changes of BVH files that keep most rules, so that the fuzzer spends its time behind the first checks.

#include "../format/test_scene.h"
#include "random.h"

#include <hiprt_build/format/box.h>
#include <hiprt_build/format/record_checks.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/format/layout.h>

#include <cstring>

namespace hiprt::fuzz {

/// Moves vertices and custom primitives, then makes every box, from the last node to the first, the bounds of its
/// content.
template <class Layout> class Refit {
 public:
  Refit(test::TestFile& file, const BufferView& view)
      : file_(file),
        view_(view),
        nodes_(reinterpret_cast<typename Layout::Node*>(file.data() + view.nodes.offset)),
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
    for (std::uint64_t i = view_.nodes.count; i-- > 0;) {
      Box boxes[kBranching];
      for (unsigned c = 0; c < kBranching; ++c) boxes[c] = content(nodes_[i].child[c], primitives);
      // validate() refuses values that a layout cannot hold.
      Layout::set_boxes(nodes_[i], boxes);
      bounds = union_of(nodes_[i]);
    }
    if (view_.nodes.count == 0) bounds = content(view_.header->root, primitives);
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
      for (unsigned which = 0; which < 2; ++which)
        format_detail::grow(box, ref_type(ref) == NodeType::kProcedural
                                     ? custom_leaf(leaves_[leaf]).box[which]
                                     : bounds_of(format_detail::leaf_triangle<Layout>(leaves_[leaf], which)));
      if ((leaves_[leaf].info.geometry_and_flags & kLastInRun) != 0) break;
    }
    format_detail::grow(primitives, box);
    return box;
  }

  test::TestFile& file_;
  const BufferView& view_;
  typename Layout::Node* nodes_;
  typename Layout::Leaf* leaves_;
};

/// Sets one 32-bit word of a section to another word of it, to an edge value, or to its neighbour.
inline void change_word(test::TestFile& file, const SectionEntry& section, Random& random) {
  const std::uint64_t words = section.count * section.stride / 4;
  if (words == 0) return;
  const std::uint64_t at = section.offset + 4 * random.below(words);
  const auto old = file.get<std::uint32_t>(at);
  constexpr std::uint32_t kEdges[] = {0u,          1u,          0xffffffffu, 0x7f800000u,
                                      0xff800000u, 0x7fc00000u, 0x80000000u, 0x0fffffffu};
  switch (random.below(6)) {
    case 0:
      file.put(at, kEdges[random.below(std::size(kEdges))]);
      break;
    case 1:
      file.put(at, old + 1);
      break;
    case 2:
      file.put(at, old - 1);
      break;
    case 3:
      file.put(at, old ^ std::uint32_t{1} << random.below(32));
      break;
    case 4:
      file.put(at, file.get<std::uint32_t>(section.offset + 4 * random.below(words)));
      break;
    default:
      file.put(at, static_cast<std::uint32_t>(old + 8 * random.below(64)));
      break;
  }
}

/// One of the file's sections that are not empty, each as often as any other.
inline SectionEntry any_section(const BufferView& view, Random& random) {
  const SectionEntry* const all[] = {&view.nodes,
                                     &view.leaves,
                                     &view.primitive_map_entry,
                                     &view.geometry_entry,
                                     &view.provenance_entry,
                                     &view.instance_entry,
                                     &view.object_entry,
                                     &view.object_file_entry,
                                     &view.motion_entry,
                                     &view.segment_entry,
                                     &view.shape_entry,
                                     &view.shape_point_entry,
                                     &view.curve_segment_entry,
                                     &view.object_shape_entry};
  SectionEntry chosen{};
  std::uint64_t seen = 0;
  for (const SectionEntry* section : all)
    if (section->count != 0 && random.below(++seen) == 0) chosen = *section;
  return chosen;
}

/// @return whether @p file had a good enough table of sections to be changed.
inline bool mutate(test::TestFile& file, Random& random) {
  file.seal_if_possible();
  const auto view = open_buffer(file.bytes());
  if (!view) return false;
  const BufferView before = *view;
  if (random.below(2) == 0) {
    dispatch_layout(before.layout(),
                    [&](auto layout) { Refit<decltype(layout)>(file, before).move_primitives(random); });
  } else {
    // A fault in the header hides all others, so the header is changed less often than the content.
    const SectionEntry header{0, 0, 0, sizeof(FileHeader), 1};
    change_word(file, random.below(16) == 0 ? header : any_section(before, random), random);
  }
  // The header may have changed: the section table is read again before it is used.
  const auto after = open_buffer(file.bytes());
  if (after && random.below(8) != 0)
    dispatch_layout(after->layout(), [&](auto layout) { Refit<decltype(layout)>(file, *after).fit(); });
  // The last byte of the checksum field is fuzz_bvh's switch.
  if (file.get<std::uint8_t>(39) == 0 && random.below(16) != 0) file.put<std::uint8_t>(39, 1);
  return true;
}

}  // namespace hiprt::fuzz
