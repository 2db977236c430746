#pragma once
/// Walks the tree of a file, and lists its triangles and the parts that they form. Internal.

#include <hiprt_build/format/bit_set.h>
#include <hiprt_build/format/record_checks.h>
#include <hiprt_build/winding.h>

#include <cstdint>
#include <vector>

namespace hiprt::build {

/// Parts of so few triangles have no parts below them: their triangles cost less than the tests of more nodes.
inline constexpr std::uint32_t kWindingLeaf = 8;

/// Fills the numbers of the nodes, and the triangles. The moments are left.
template <class Layout> class WindingWalk {
 public:
  WindingWalk(const BufferView& view, std::uint32_t mask)
      : view_(view), mask_(mask), seen_(view.header->primitive_count) {}

  WindingArrays run() {
    if (view_.header->root != kInvalidRef) open(view_.header->root);
    while (!steps_.empty()) {
      const Step step = steps_.back();
      steps_.pop_back();
      step.closes ? close(step.number) : open(step.number);
    }
    return std::move(arrays_);
  }

 private:
  struct Step {
    bool closes;
    std::uint32_t number;  ///< The node to close, or the reference to open.
  };

  std::uint32_t triangle_count() const { return static_cast<std::uint32_t>(arrays_.triangles.size()); }

  void open(NodeRef ref) {
    const auto node = static_cast<std::uint32_t>(arrays_.nodes.size());
    arrays_.nodes.push_back(WindingNode{});
    arrays_.nodes.back().first = triangle_count();
    if (!is_box(ref)) {
      add_run(ref);
      return close(node);
    }
    steps_.push_back({true, node});
    const auto& box_node = view_.node_array<typename Layout::Node>()[view_.node_number(ref)];
    for (unsigned c = kBranching; c-- > 0;)
      if (box_node.child[c] != kInvalidRef) steps_.push_back({false, box_node.child[c]});
  }

  void close(std::uint32_t number) {
    WindingNode& node = arrays_.nodes[number];
    node.count = triangle_count() - node.first;
    if (node.count <= kWindingLeaf) arrays_.nodes.resize(node.count == 0 ? number : number + 1);
    if (number < arrays_.nodes.size()) arrays_.nodes[number].next = static_cast<std::uint32_t>(arrays_.nodes.size());
  }

  void add_run(NodeRef ref) {
    const auto leaves = view_.records<typename Layout::Leaf>(view_.leaves);
    for (std::uint64_t i = (ref_offset(ref) - view_.leaves.offset) / view_.leaves.stride;; ++i) {
      const auto& leaf = leaves[static_cast<std::size_t>(i)];
      for (unsigned slot = 0; slot < 2; ++slot)
        if (leaf.info.primitive[slot] != kInvalidId) add_triangle(leaf, slot);
      if ((leaf.info.geometry_and_flags & kLastInRun) != 0) return;
    }
  }

  /// Spatial splits put a triangle into several leaves: the first one counts.
  void add_triangle(const typename Layout::Leaf& leaf, unsigned slot) {
    const GeometryRecord& geometry = view_.geometries[leaf.info.geometry_and_flags & kGeometryMask];
    if ((geometry.mask & mask_) == 0 || seen_.insert(geometry.first_primitive + leaf.info.primitive[slot])) return;
    const std::uint32_t id = leaf.info.triangle_ids >> (8 * slot);
    const unsigned one = TriangleId::u_source(id), two = TriangleId::v_source(id);
    const unsigned corner[3] = {3 - one - two, one, two};
    const auto stored = format_detail::leaf_triangle<Layout>(leaf, slot);
    WindingTriangle triangle;
    for (unsigned k = 0; k < 3; ++k)
      for (unsigned axis = 0; axis < 3; ++axis) triangle.corner[k][axis] = stored.corner[corner[k]][axis];
    arrays_.triangles.push_back(triangle);
  }

  const BufferView& view_;
  std::uint32_t mask_;
  BitSet seen_;
  std::vector<Step> steps_;
  WindingArrays arrays_;
};

}  // namespace hiprt::build
