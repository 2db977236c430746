#pragma once
/// Widens the boxes of a finished tree, for AMD's ray instruction (widened_boxes.h). Internal.
///
/// Rounding is monotonic. So a child's boxes stay inside the box that its parent states, and no order of nodes matters.

#include <hiprt_build/encode/wide_node.h>
#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_build/format/node_places.h>
#include <hiprt_device/format/buffer.h>
#include <hiprt_device/format/widened_boxes.h>

namespace hiprt::build {

/// Step: the boxes of node i.
template <class Layout> struct WidenNodeStep {
  NodeArray<typename Layout::Node> nodes;
  const FileHeader* header;  ///< With the margin; 0: nothing is to do.

  HIPRT_HD void operator()(std::size_t i) const {
    if (header->box_margin == 0.0f) return;
    for (unsigned c = 0; c < kBranching; ++c)
      Layout::set_box(nodes[i], c, widened(Layout::box(nodes[i], c), header->box_margin));
  }
};

/// Step: the header's margin and bounds. @pre its bounds are those before.
struct WidenHeaderStep {
  FileHeader* header;
  std::uint64_t nodes;  ///< How many the file has.

  HIPRT_HD void operator()(std::size_t) const {
    const float margin = nodes == 0 || header->root == kInvalidRef ? 0.0f : box_margin_of(header->bounds);
    header->box_margin = margin;
    header->features &= ~feature_bit(Feature::kWidenedBoxes);
    if (margin != 0.0f) header->features |= feature_bit(Feature::kWidenedBoxes);
  }
};

/// Step: the header's bounds, those of the widened root. @pre the file has nodes, and WidenNodeStep has widened them.
template <class Layout> struct WidenBoundsStep {
  FileHeader* header;
  NodeArray<const typename Layout::Node> nodes;

  HIPRT_HD void operator()(std::size_t) const {
    if (header->box_margin != 0.0f)
      header->bounds = bounded(node_box<Layout>(nodes[0]), widened(header->bounds, header->box_margin));
  }
};

/// Step: WidenHeaderStep after a refit, if the file had widened boxes before.
struct WidenAgainStep {
  WidenHeaderStep header;

  HIPRT_HD void operator()(std::size_t i) const {
    if ((header.header->features & feature_bit(Feature::kWidenedBoxes)) != 0) header(i);
  }
};

/// Widens the boxes of a file on the CPU. @param bytes of the file, whose header and nodes are complete.
template <class Engine>
void widen_file(Engine& engine, std::byte* bytes, std::uint64_t first_node, std::uint64_t nodes) {
  auto* header = reinterpret_cast<FileHeader*>(bytes);
  const auto widen = [&](auto layout) {
    using Layout = decltype(layout);
    const NodeArray<typename Layout::Node> records(bytes + first_node,
                                                   NodePlaces(sizeof(typename Layout::Node), false));
    WidenHeaderStep{header, nodes}(0);
    if (header->box_margin == 0.0f) return;
    engine.for_each(nodes, WidenNodeStep<Layout>{records, header});
    WidenBoundsStep<Layout>{header, records}(0);
  };
  if (static_cast<NodeLayout>(header->layout) == NodeLayout::kFloat) widen(FloatLayout{});
  if (static_cast<NodeLayout>(header->layout) == NodeLayout::kHalf) widen(HalfLayout{});
}

}  // namespace hiprt::build
