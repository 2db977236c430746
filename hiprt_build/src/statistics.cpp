#include <hiprt_build/statistics.h>
#include <hiprt_device/format/layout.h>

#include <algorithm>
#include <vector>

namespace hiprt::build {

namespace {

/// Half the surface; in double, because float areas of large scenes overflow.
double half_area(const Box& box) {
  const double x = double{box.max[0]} - double{box.min[0]};
  const double y = double{box.max[1]} - double{box.min[1]};
  const double z = double{box.max[2]} - double{box.min[2]};
  return x * y + y * z + z * x;
}

double common_half_area(const Box& a, const Box& b) {
  Box common{};
  for (unsigned axis = 0; axis < 3; ++axis) {
    common.min[axis] = std::max(a.min[axis], b.min[axis]);
    common.max[axis] = std::min(a.max[axis], b.max[axis]);
    if (common.min[axis] > common.max[axis]) return 0;
  }
  return half_area(common);
}

template <class Layout> class TreeMeter {
 public:
  TreeMeter(const BufferView& view, const SahCosts& costs)
      : view_(view),
        nodes_(view.records<typename Layout::Node>(view.nodes)),
        leaves_(view.records<typename Layout::Leaf>(view.leaves)),
        area_(nodes_.size()),
        costs_(costs) {}

  TreeStatistics measure() {
    result_.nodes = nodes_.size();
    result_.leaves = leaves_.size();
    const NodeRef root = view_.header->root;
    if (root == kInvalidRef) return result_;
    const double root_area = half_area(view_.header->bounds);
    if (is_box(root))
      area_[node_index(root)] = root_area;
    else
      add_run(root, root_area);
    // Children lie behind their parent, which therefore has told them their area before they are met.
    for (std::size_t i = 0; i < nodes_.size(); ++i) add_node(i);
    finish(root_area);
    return result_;
  }

 private:
  std::size_t node_index(NodeRef ref) const {
    return static_cast<std::size_t>((ref_offset(ref) - view_.nodes.offset) / view_.nodes.stride);
  }

  void add_run(NodeRef ref, double area) {
    ++result_.leaf_runs;
    const bool custom = ref_type(ref) == NodeType::kProcedural;
    std::uint64_t leaf = (ref_offset(ref) - view_.leaves.offset) / view_.leaves.stride;
    for (;; ++leaf) {
      const LeafInfo& info = leaves_[static_cast<std::size_t>(leaf)].info;
      (custom ? result_.leaf_customs : result_.leaf_triangles) += info.primitive[1] == kInvalidId ? 1 : 2;
      if (custom) ++result_.custom_leaves;
      leaf_cost_ += area * (custom ? costs_.custom : costs_.leaf);
      if ((info.geometry_and_flags & kLastInRun) != 0) return;
    }
  }

  Box stated_box(const typename Layout::Node& node, unsigned child) const {
    const Box box = Layout::box(node, child);
    return Layout::kId == NodeLayout::kHalf ? bounded(box, view_.header->bounds) : box;
  }

  void add_node(std::size_t i) {
    const typename Layout::Node& node = nodes_[i];
    node_area_ += area_[i];
    unsigned children = 0;
    for (unsigned c = 0; c < kBranching; ++c) {
      const NodeRef ref = node.child[c];
      if (ref == kInvalidRef) continue;
      ++children;
      const Box box = stated_box(node, c);
      for (unsigned other = 0; other < c; ++other)
        if (node.child[other] != kInvalidRef) overlap_area_ += common_half_area(box, stated_box(node, other));
      if (is_box(ref))
        area_[node_index(ref)] = half_area(box);
      else
        add_run(ref, half_area(box));
    }
    ++result_.nodes_by_children[children];
    children_ += children;
  }

  /// Box nodes below the root, counted from the back: a node's children are done before it.
  std::uint32_t depth() const {
    std::vector<std::uint32_t> depths(nodes_.size());
    for (std::size_t i = nodes_.size(); i-- > 0;) {
      std::uint32_t deepest = 0;
      for (const NodeRef ref : nodes_[i].child)
        if (ref != kInvalidRef && is_box(ref)) deepest = std::max(deepest, depths[node_index(ref)]);
      depths[i] = deepest + 1;
    }
    return depths.empty() ? 0 : depths[0];
  }

  void finish(double root_area) {
    result_.depth = depth();
    const double nodes = static_cast<double>(result_.nodes), leaves = static_cast<double>(result_.leaves);
    const double customs = static_cast<double>(result_.custom_leaves);
    const double all_leaves = (leaves - customs) * costs_.leaf + customs * costs_.custom;
    if (result_.nodes != 0) result_.fill = static_cast<double>(children_) / (nodes * kBranching);
    if (result_.leaves != 0)
      result_.pair_fill = static_cast<double>(result_.leaf_triangles + result_.leaf_customs) / (leaves * 2);
    if (node_area_ > 0) result_.sibling_overlap = overlap_area_ / node_area_;
    // A scene in one point or on one line: every ray that meets the root meets everything.
    if (!(root_area > 0))
      result_.sah_cost = nodes * costs_.box_node + all_leaves;
    else if (!is_box(view_.header->root))
      result_.sah_cost = all_leaves;
    else
      result_.sah_cost = (node_area_ * costs_.box_node + leaf_cost_) / root_area;
  }

  const BufferView& view_;
  std::span<const typename Layout::Node> nodes_;
  std::span<const typename Layout::Leaf> leaves_;
  std::vector<double> area_;  ///< Of the box that a node's parent states for it.
  SahCosts costs_;
  std::uint64_t children_ = 0;
  double node_area_ = 0, leaf_cost_ = 0, overlap_area_ = 0;
  TreeStatistics result_;
};

}  // namespace

TreeStatistics measure_tree(const BufferView& view, const SahCosts& costs) {
  return dispatch_layout(view.layout(),
                         [&](auto layout) { return TreeMeter<decltype(layout)>(view, costs).measure(); });
}

}  // namespace hiprt::build
