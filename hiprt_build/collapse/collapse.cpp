#include <hiprt_build/collapse/collapse.h>

namespace hiprt::build {
namespace {

constexpr std::uint32_t kTaskSize = 4096;

}  // namespace

WideTree::WideTree(CpuEngine& engine, const BinaryTree& tree, std::span<const PrimitiveGroup> groups,
                   const SahCosts& costs, unsigned max_primitives)
    : engine_(engine), tree_(tree), groups_(groups), costs_{costs.box_node, costs.leaf, costs.custom, max_primitives} {
  if (tree.empty()) return;
  engine.monitor().start("collapse", 0.85, tree.references.size());
  plan_ = engine.allocate<CollapsePlan>(tree.nodes.size());
  plan(0);
}

void WideTree::plan(std::uint32_t node) {
  const std::uint32_t count = tree_.nodes[node].count;
  if (count == 1) {
    const PrimitiveGroup& group = groups_[tree_.references[tree_.nodes[node].first].leaf];
    plan_[node] = plan_leaf(half_area(tree_.nodes[node].box()), group.is_pair() ? 2 : 1, group.is_custom(), costs_);
    engine_.monitor().add(1);
    return;
  }
  const std::uint32_t left = tree_.left(node), right = tree_.right(node);
  if (count < kTaskSize) {
    plan(left);
    plan(right);
  } else {
    engine_.invoke([&] { plan(left); }, [&] { plan(right); });
  }
  plan_[node] = plan_inner(plan_[left], plan_[right], half_area(tree_.nodes[node].box()), costs_);
}

WideTree::Children WideTree::children(std::uint32_t node) const {
  Children result;
  const WideShare share = wide_share(plan_[node]);
  gather(tree_.left(node), share.left, result);
  gather(tree_.right(node), share.right, result);
  return result;
}

void WideTree::gather(std::uint32_t node, unsigned slots, Children& result) const {
  while (slots > 1 && plan_[node].choice(slots - 1) == 0) --slots;
  if (slots == 1) {
    result.node[result.count++] = node;
    return;
  }
  const unsigned from_left = plan_[node].choice(slots - 1);
  gather(tree_.left(node), from_left, result);
  gather(tree_.right(node), slots - from_left, result);
}

double WideTree::cost() const {
  if (tree_.empty()) return 0.0;
  const double area = static_cast<double>(half_area(tree_.nodes[0].box()));
  return area > 0.0 ? static_cast<double>(plan_[0].cost[0]) / area : 0.0;
}

}  // namespace hiprt::build
