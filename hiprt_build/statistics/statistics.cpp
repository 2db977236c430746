#include <hiprt_build/statistics.h>
#include <hiprt_build/statistics/tree_quality_steps.h>

#include <algorithm>
#include <vector>

namespace hiprt::build {

namespace {

double common_half_area(const Box& a, const Box& b) {
  Box common{};
  for (unsigned axis = 0; axis < 3; ++axis) {
    common.min[axis] = std::max(a.min[axis], b.min[axis]);
    common.max[axis] = std::min(a.max[axis], b.max[axis]);
    if (common.min[axis] > common.max[axis]) return 0;
  }
  return exact_half_area(common);
}

template <class Layout> class TreeMeter {
 public:
  TreeMeter(const BufferView& view, const SahCosts& costs)
      : view_(view),
        nodes_(view.node_array<typename Layout::Node>()),
        leaves_(view.records<typename Layout::Leaf>(view.leaves)),
        quality_{view.header, nodes_, leaves_.data(), view.nodes.offset, view.leaves.offset, costs} {}

  TreeStatistics measure() {
    result_.nodes = view_.node_count();
    result_.leaves = leaves_.size();
    const NodeRef root = view_.header->root;
    if (root == kInvalidRef) return result_;
    if (!is_box(root)) count_run(root);
    for (std::size_t i = 0; i < result_.nodes; ++i) add_node(i);
    finish(exact_half_area(view_.header->bounds));
    return result_;
  }

 private:
  void count_run(NodeRef ref) {
    ++result_.leaf_runs;
    const bool custom = ref_type(ref) == NodeType::kProcedural;
    for (const auto* leaf = quality_.run(ref);; ++leaf) {
      const LeafInfo& info = leaf->info;
      (custom ? result_.leaf_customs : result_.leaf_triangles) +=
          info.primitive[1] == kInvalidId || view_.has_instances() ? 1 : 2;
      if (custom) ++result_.custom_leaves;
      if ((info.geometry_and_flags & kLastInRun) != 0) return;
    }
  }

  void add_node(std::size_t i) {
    const typename Layout::Node& node = nodes_[i];
    sums_.add(quality_(i));
    unsigned children = 0;
    for (unsigned c = 0; c < kBranching; ++c) {
      const NodeRef ref = node.child[c];
      if (ref == kInvalidRef) continue;
      ++children;
      const Box box = quality_.stated_box(node, c);
      for (unsigned other = 0; other < c; ++other)
        if (node.child[other] != kInvalidRef) overlap_area_ += common_half_area(box, quality_.stated_box(node, other));
      if (!is_box(ref)) count_run(ref);
    }
    ++result_.nodes_by_children[children];
    children_ += children;
  }

  /// Box nodes below the root, counted from the back: a node's children are done before it.
  std::uint32_t depth() const {
    std::vector<std::uint32_t> depths(result_.nodes);
    for (std::size_t i = depths.size(); i-- > 0;) {
      std::uint32_t deepest = 0;
      for (const NodeRef ref : nodes_[i].child)
        if (ref != kInvalidRef && is_box(ref)) deepest = std::max(deepest, depths[view_.node_number(ref)]);
      depths[i] = deepest + 1;
    }
    return depths.empty() ? 0 : depths[0];
  }

  void finish(double root_area) {
    result_.depth = depth();
    const double nodes = static_cast<double>(result_.nodes), leaves = static_cast<double>(result_.leaves);
    if (result_.nodes != 0) result_.fill = static_cast<double>(children_) / (nodes * kBranching);
    if (result_.leaves != 0)
      result_.pair_fill = static_cast<double>(result_.leaf_triangles + result_.leaf_customs) / (leaves * 2);
    const double node_area = sums_.inner + (result_.nodes == 0 ? 0.0 : root_area);
    if (node_area > 0) result_.sibling_overlap = overlap_area_ / node_area;
    result_.exchange_slack = sums_.exchange_slack();
    result_.sah_cost = quality_.sah_cost(sums_);
  }

  const BufferView& view_;
  NodeArray<const typename Layout::Node> nodes_;
  std::span<const typename Layout::Leaf> leaves_;
  TreeQuality<Layout> quality_;
  QualitySums sums_;
  std::uint64_t children_ = 0;
  double overlap_area_ = 0;
  TreeStatistics result_;
};

}  // namespace

TreeStatistics measure_tree(const BufferView& view, const SahCosts& costs) {
  return dispatch_layout(view.layout(),
                         [&](auto layout) { return TreeMeter<decltype(layout)>(view, costs).measure(); });
}

}  // namespace hiprt::build
