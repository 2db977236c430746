#pragma once
/// Visits every leaf of a checked tree. Internal.

#include <hiprt_build/format/check.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/format/layout.h>

#include <cstdint>

namespace hiprt::format_detail {

/// A leaf that a walk over the tree visits.
struct LeafVisit {
  std::uint64_t index;
  bool custom;     ///< Whether it is a custom leaf, by the type of the reference to its run.
  const Box& box;  ///< The box that is stated for its run; finite.
};

/// Calls visit(LeafVisit) for every leaf until a call fails.
template <class Layout, class Visit> Check for_each_leaf(const BufferView& view, Visit&& visit) {
  const auto leaves = view.records<typename Layout::Leaf>(view.leaves);
  const auto visit_run = [&](NodeRef ref, Box box) -> Check {
    const bool custom = ref_type(ref) == NodeType::kProcedural;
    if constexpr (Layout::kId == NodeLayout::kHalf) box = bounded(box, view.header->bounds);
    for (std::uint64_t leaf = (ref_offset(ref) - view.leaves.offset) / view.leaves.stride;; ++leaf) {
      if (auto visited = visit(LeafVisit{leaf, custom, box}); !visited) return visited;
      if ((leaves[leaf].info.geometry_and_flags & kLastInRun) != 0) return {};
    }
  };
  const NodeRef root = view.header->root;
  if (root != kInvalidRef && !is_box(root)) return visit_run(root, view.header->bounds);
  const auto nodes = view.node_array<typename Layout::Node>();
  for (std::uint64_t i = 0, count = view.node_count(); i < count; ++i)
    for (unsigned c = 0; c < kBranching; ++c)
      if (const NodeRef child = nodes[i].child[c]; child != kInvalidRef && !is_box(child))
        if (auto run = visit_run(child, Layout::box(nodes[i], c)); !run) return run;
  return {};
}

}  // namespace hiprt::format_detail
