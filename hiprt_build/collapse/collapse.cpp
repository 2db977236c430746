#include <hiprt_build/collapse/collapse.h>

namespace hiprt::build {
namespace {

constexpr std::uint32_t kTaskSize = 4096;

}  // namespace

WideTree::WideTree(CpuEngine& engine, const DepthFirstTree& tree, const SahCosts& costs, unsigned max_primitives)
    : engine_(engine), tree_(tree), costs_{costs.box_node, costs.leaf, costs.custom, max_primitives} {
  if (tree.empty()) return;
  engine.monitor().start("collapse", 0.85, tree.references.size());
  plan_ = engine.allocate<CollapsePlan>(tree.nodes.size());
  make_plan(0);
}

void WideTree::make_plan(std::uint32_t node) {
  const std::uint32_t count = tree_.nodes[node].count;
  if (count == 1) {
    const LeafContents contents = tree_.references[tree_.nodes[node].first].contents;
    plan_[node] = plan_leaf(half_area(tree_.nodes[node].box), contents.is_pair() ? 2 : 1, contents.is_custom(), costs_);
    engine_.monitor().add(1);
    return;
  }
  const std::uint32_t left = tree_.left(node), right = tree_.right(node);
  if (count < kTaskSize) {
    make_plan(left);
    make_plan(right);
  } else {
    engine_.invoke([&] { make_plan(left); }, [&] { make_plan(right); });
  }
  plan_[node] = plan_inner(plan_[left], plan_[right], half_area(tree_.nodes[node].box), costs_);
}

WideTree::Children WideTree::children(std::uint32_t node) const {
  Children result;
  for (; result.count < kBranching; ++result.count) {
    const auto child = WideChildren<const WideTree&>{*this}.find(node, result.count);
    if (!child.exists) break;
    result.node[result.count] = child.ref;
  }
  return result;
}

double WideTree::cost() const {
  if (tree_.empty()) return 0.0;
  const double area = static_cast<double>(half_area(tree_.nodes[0].box));
  return area > 0.0 ? static_cast<double>(plan_[0].cost[0]) / area : 0.0;
}

}  // namespace hiprt::build
