#include <hiprt_build/steps/collapse.h>

#include <algorithm>

namespace hiprt::build {
namespace {

constexpr std::uint32_t kTaskSize = 4096;

}  // namespace

WideTree::WideTree(CpuEngine& engine, const BinaryTree& tree, std::span<const PrimitiveGroup> groups,
                   const SahCosts& costs, unsigned max_primitives)
    : engine_(engine), tree_(tree), groups_(groups), costs_(costs), max_primitives_(max_primitives) {
  if (tree.empty()) return;
  engine.monitor().start("collapse", 0.85, tree.references.size());
  plan_ = engine.allocate<CollapsePlan>(tree.nodes.size());
  plan(0);
}

void WideTree::plan(std::uint32_t node) {
  const std::uint32_t count = tree_.nodes[node].count;
  if (count == 1) {
    const float cost = half_area(tree_.nodes[node].box()) * leaf_cost(node);
    const bool pair = groups_[tree_.references[tree_.nodes[node].first].leaf].is_pair();
    plan_[node] = CollapsePlan{{cost, cost, cost}, {0, 0, 0}, {0, 0, 0}, static_cast<std::uint8_t>(pair ? 2 : 1)};
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
  plan_inner(node);
}

void WideTree::plan_inner(std::uint32_t node) {
  const CollapsePlan& left = plan_[tree_.left(node)];
  const CollapsePlan& right = plan_[tree_.right(node)];
  CollapsePlan& result = plan_[node];
  // The cheapest way to share `slots` children between both sides.
  const auto distribute = [&](unsigned slots, std::uint8_t& from_left, std::uint32_t& nodes) {
    float best = Aabb::kInfinity;
    from_left = 1;
    for (unsigned k = 1; k < slots; ++k) {
      if (k > 3 || slots - k > 3) continue;
      const float cost = left.cost[k - 1] + right.cost[slots - k - 1];
      if (!(cost < best) && !(k == 2 && !(best < Aabb::kInfinity))) continue;
      best = cost;
      from_left = static_cast<std::uint8_t>(k);
    }
    nodes = left.nodes[from_left - 1] + right.nodes[slots - from_left - 1];
    return best;
  };
  const float area = half_area(tree_.nodes[node].box());
  const std::uint32_t count = tree_.nodes[node].count;
  std::uint32_t nodes = 0;
  result.cost[0] = distribute(4, result.choice[0], nodes) + area * costs_.box_node;
  result.nodes[0] = nodes + 1;
  result.primitives = count_primitives(node);
  const bool may_run = result.primitives <= max_primitives_;
  const float run_cost = may_run ? area * leaf_cost(node) * static_cast<float>(count) : Aabb::kInfinity;
  if (may_run && run_cost <= result.cost[0]) {
    result.cost[0] = run_cost;
    result.nodes[0] = 0;
    result.choice[0] = 0;
  }
  for (unsigned i = 1; i < 3; ++i) {
    std::uint8_t from_left = 0;
    const float cost = distribute(i + 1, from_left, nodes);
    const bool split = cost < result.cost[i - 1];
    result.cost[i] = split ? cost : result.cost[i - 1];
    result.nodes[i] = split ? nodes : result.nodes[i - 1];
    result.choice[i] = split ? from_left : std::uint8_t{0};
  }
}

/// Of an inner node.
std::uint8_t WideTree::count_primitives(std::uint32_t node) const {
  constexpr int kMany = 255;
  const std::uint32_t left = tree_.left(node), right = tree_.right(node);
  const int sum = plan_[left].primitives + plan_[right].primitives;
  // Most subtrees are too large for a run whatever is in them.
  const bool too_many = sum > static_cast<int>(max_primitives_);
  return static_cast<std::uint8_t>(too_many || is_custom(left) != is_custom(right) ? kMany : sum);
}

WideTree::Children WideTree::children(std::uint32_t node) const {
  Children result;
  const unsigned from_left = plan_[node].choice[0];
  gather(tree_.left(node), from_left, result);
  gather(tree_.right(node), kBranching - from_left, result);
  return result;
}

void WideTree::gather(std::uint32_t node, unsigned slots, Children& result) const {
  while (slots > 1 && (tree_.nodes[node].count == 1 || plan_[node].choice[slots - 1] == 0)) --slots;
  if (slots == 1) {
    result.node[result.count++] = node;
    return;
  }
  const unsigned from_left = plan_[node].choice[slots - 1];
  gather(tree_.left(node), from_left, result);
  gather(tree_.right(node), slots - from_left, result);
}

double WideTree::cost() const {
  if (tree_.empty()) return 0.0;
  const double area = static_cast<double>(half_area(tree_.nodes[0].box()));
  return area > 0.0 ? static_cast<double>(plan_[0].cost[0]) / area : 0.0;
}

}  // namespace hiprt::build
