#pragma once
/// Finds the four-wide tree of lowest surface area cost over a binary tree. Dynamic programming from the leaves to the
/// root: a node's plan is made of its children's plans. Internal.
///
/// Ylitie, Karras, Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", 2017, section 3.2.

#include <hiprt_device/format/node.h>

#include <cstdint>

namespace hiprt::build {

/// What the plans are made for.
struct CollapseCosts {
  float box_node, leaf, custom;  ///< As SahCosts.
  /// Most triangles or custom primitives in a run of several leaves, up to 64. (A single leaf is always a run.)
  std::uint32_t max_primitives;
};

/// Leaves of a tree: a file addresses fewer.
inline constexpr std::uint32_t kMaxPlannedLeaves = 1u << 29;
/// Wide nodes that are counted. There are fewer than leaves, so no file addresses more.
inline constexpr std::uint32_t kMaxPlannedNodes = (1u << 28) - 1;

/// What is below a node: bit set of CollapsePlan::kind.
inline constexpr std::uint32_t kHasTriangles = 1, kHasCustoms = 2;

/// If a subtree needs more stack entries than this, its root becomes a node of two children, which adds only one entry.
/// So no tree of 60 levels exceeds the limit of a file. Nor does a tree of Morton codes: of its 95 levels at most 40
/// need three entries.
inline constexpr std::uint32_t kWideStackNeed = 120;

/// How the subtree of a binary node is best shown as one, two or three children of a wide node. "Form i": as at most
/// i + 1 children.
struct CollapsePlan {
  static constexpr std::uint32_t kManyPrimitives = 127;

  float cost[3];  ///< Least cost of form i.
  std::uint32_t leaves : 29;
  std::uint32_t choice2 : 2;  ///< Form 2: 0 as form 1, else how many of three children come from the left.
  std::uint32_t choice1 : 1;  ///< Form 1: 0 as form 0, else one child from either side.
  std::uint32_t nodes : 28;   ///< Wide nodes of form 0, up to kMaxPlannedNodes.
  std::uint32_t kind : 2;     ///< kHasTriangles, kHasCustoms.
  std::uint32_t choice0 : 2;  ///< Form 0: 0 a run of leaves, else a wide node: how many of four children from the left.
  std::uint32_t primitives : 7;  ///< kManyPrimitives: that many or more, or both triangles and custom ones.
  std::uint32_t need : 8;        ///< Stack entries that a traversal of form 0 can need; 255: or more.
  std::uint32_t parts_need : 8;  ///< The same of the children of forms 1 and 2.
  std::uint32_t nodes1 : 4;      ///< Wide nodes of form 1, less those of form 0, plus kBias.
  std::uint32_t nodes2 : 4;      ///< Of form 2, less those of form 0, plus kBias.
  std::uint32_t narrow : 1;      ///< Form 0: a wide node of two children only, one from either side.

  static constexpr std::uint32_t kBias = 8;

  HIPRT_HD bool is_run() const { return choice0 == 0; }
  /// Whether everything below is a custom primitive.
  HIPRT_HD bool is_custom() const { return kind == kHasCustoms; }
  /// Wide nodes of form i.
  HIPRT_HD std::uint32_t form_nodes(unsigned i) const {
    return i == 0 ? nodes : i == 1 ? nodes + nodes1 - kBias : nodes + nodes2 - kBias;
  }
  HIPRT_HD float form_cost(unsigned i) const { return i == 0 ? cost[0] : i == 1 ? cost[1] : cost[2]; }
  HIPRT_HD std::uint32_t form_need(unsigned i) const { return i == 0 ? need : parts_need; }
  /// Forms 1 and 2: 0 as the form before it, else how many of the i + 1 children come from the left.
  HIPRT_HD unsigned choice(unsigned i) const { return i == 1 ? choice1 : choice2; }
};
static_assert(sizeof(CollapsePlan) == 24);

/// @param half_area of the leaf's box. @param primitives 1 or 2.
HIPRT_HD HIPRT_FORCE_INLINE CollapsePlan plan_leaf(float half_area, unsigned primitives, bool custom,
                                                   const CollapseCosts& costs) {
  const float cost = half_area * (custom ? costs.custom : costs.leaf);
  CollapsePlan plan{};
  plan.cost[0] = plan.cost[1] = plan.cost[2] = cost;
  plan.leaves = 1;
  plan.kind = (custom ? kHasCustoms : kHasTriangles) & 3u;
  plan.primitives = primitives & 3u;
  plan.nodes1 = plan.nodes2 = CollapsePlan::kBias;
  return plan;
}

namespace collapse_detail {

/// So many children, k of them from the left.
struct Share {
  float cost;
  unsigned from_left;
};

HIPRT_HD HIPRT_FORCE_INLINE Share cheaper(const Share& best, const CollapsePlan& left, const CollapsePlan& right,
                                          unsigned slots, unsigned k) {
  const Share other{left.form_cost(k - 1) + right.form_cost(slots - k - 1), k};
  return other.cost < best.cost ? other : best;
}

HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t larger(std::uint32_t a, std::uint32_t b) { return a > b ? a : b; }

HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t split_nodes(const CollapsePlan& left, const CollapsePlan& right,
                                                      unsigned slots, unsigned k) {
  return left.form_nodes(k - 1) + right.form_nodes(slots - k - 1);
}
HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t split_need(const CollapsePlan& left, const CollapsePlan& right,
                                                     unsigned slots, unsigned k) {
  return larger(left.form_need(k - 1), right.form_need(slots - k - 1));
}

/// Form 0 as a wide node.
HIPRT_HD HIPRT_FORCE_INLINE void plan_node(const CollapsePlan& left, const CollapsePlan& right, float half_area,
                                           const CollapseCosts& costs, CollapsePlan& plan) {
  // Where costs are infinite or no numbers, two from either side.
  Share best{left.cost[1] + right.cost[1], 2};
  best = cheaper(best, left, right, 4, 1);
  best = cheaper(best, left, right, 4, 3);
  std::uint32_t need = split_need(left, right, 4, best.from_left) + 3;
  std::uint32_t nodes = split_nodes(left, right, 4, best.from_left) + 1;
  if (need > kWideStackNeed) {
    best.cost = left.cost[0] + right.cost[0];
    need = larger(left.need, right.need) + 1;
    nodes = left.nodes + right.nodes + 1;
    plan.narrow = 1;
  }
  plan.cost[0] = best.cost + half_area * costs.box_node;
  plan.choice0 = best.from_left & 3u;
  plan.nodes = (nodes < kMaxPlannedNodes ? nodes : kMaxPlannedNodes) & kMaxPlannedNodes;
  plan.need = (need < 255 ? need : 255u) & 255u;
}

/// Form 0 as a run, if it may be one and that is cheaper.
HIPRT_HD HIPRT_FORCE_INLINE void plan_run(const CollapsePlan& left, const CollapsePlan& right, float half_area,
                                          const CollapseCosts& costs, CollapsePlan& plan) {
  const std::uint32_t sum = left.primitives + right.primitives;
  const bool may_run = sum <= costs.max_primitives && left.kind == right.kind;
  plan.primitives = (may_run ? sum : CollapsePlan::kManyPrimitives) & CollapsePlan::kManyPrimitives;
  if (!may_run) return;
  const float cost = half_area * (plan.is_custom() ? costs.custom : costs.leaf) * static_cast<float>(plan.leaves);
  if (!(cost <= plan.cost[0])) return;
  plan.cost[0] = cost;
  plan.choice0 = 0;
  plan.nodes = 0;
  plan.need = 0;
}

/// Of a form's wide nodes, less those of form 0: false if it cannot be written down.
HIPRT_HD HIPRT_FORCE_INLINE bool set_form_nodes(std::uint32_t nodes, const CollapsePlan& plan, std::uint32_t& biased) {
  biased = nodes - plan.nodes + CollapsePlan::kBias;
  return biased < 2 * CollapsePlan::kBias;
}

/// Form 1: one from either side, or as form 0.
HIPRT_HD HIPRT_FORCE_INLINE void plan_two(const CollapsePlan& left, const CollapsePlan& right, CollapsePlan& plan) {
  const float cost = left.cost[0] + right.cost[0];
  std::uint32_t nodes = 0;
  const bool split = set_form_nodes(left.nodes + right.nodes, plan, nodes) && cost < plan.cost[0];
  plan.cost[1] = split ? cost : plan.cost[0];
  plan.choice1 = split ? 1u : 0u;
  plan.nodes1 = (split ? nodes : CollapsePlan::kBias) & 15u;
  plan.parts_need = (split ? larger(left.need, right.need) : plan.need) & 255u;
}

/// Form 2: one from one side, two from the other, or as form 1.
HIPRT_HD HIPRT_FORCE_INLINE void plan_three(const CollapsePlan& left, const CollapsePlan& right, CollapsePlan& plan) {
  const Share best = cheaper({left.cost[0] + right.cost[1], 1}, left, right, 3, 2);
  std::uint32_t nodes = 0;
  const bool fits = set_form_nodes(split_nodes(left, right, 3, best.from_left), plan, nodes);
  const bool split = fits && best.cost < plan.cost[1];
  plan.cost[2] = split ? best.cost : plan.cost[1];
  plan.choice2 = (split ? best.from_left : 0u) & 3u;
  plan.nodes2 = (split ? nodes : plan.nodes1) & 15u;
  if (split) plan.parts_need = larger(plan.parts_need, split_need(left, right, 3, best.from_left)) & 255u;
}

}  // namespace collapse_detail

/// The plan of an inner node. @param half_area of its box.
HIPRT_HD HIPRT_FORCE_INLINE CollapsePlan plan_inner(const CollapsePlan& left, const CollapsePlan& right,
                                                    float half_area, const CollapseCosts& costs) {
  CollapsePlan plan{};
  plan.leaves = (left.leaves + right.leaves) & (kMaxPlannedLeaves - 1);
  plan.kind = (left.kind | right.kind) & 3u;
  collapse_detail::plan_node(left, right, half_area, costs, plan);
  collapse_detail::plan_run(left, right, half_area, costs, plan);
  collapse_detail::plan_two(left, right, plan);
  collapse_detail::plan_three(left, right, plan);
  return plan;
}

/// How many children of a wide node come from either side of its binary node.
struct WideSplit {
  unsigned left, right;
};

/// @pre !plan.is_run()
HIPRT_HD HIPRT_FORCE_INLINE WideSplit wide_split(const CollapsePlan& plan) {
  if (plan.narrow != 0) return {1, 1};
  return {plan.choice0, kBranching - plan.choice0};
}

}  // namespace hiprt::build
