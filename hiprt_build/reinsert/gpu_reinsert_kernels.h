#pragma once
/// Kernels of gpu_reinsert.hip. Internal.

#include <hiprt_build/pipeline/gpu_state.h>
#include <hiprt_build/reinsert/reinsert_steps.h>

namespace hiprt::build::kernels {

/// How many leaves a tree has. Without a count its numbers may have gaps.
struct TreeSize {
  /// A leaf and the node of the same number are neighbours: if both searched in the same round, their moves would
  /// conflict. So the leaves' turn comes half a cycle later. Arrays over subtrees need kRoom more places for each half.
  static constexpr std::uint32_t kCycle = 1u << Lookers::kUsualShift, kRoom = kCycle - 1;

  std::uint32_t capacity;
  const std::uint32_t* leaves;  ///< On the device; nullptr: there is no count.

  HIPRT_HD std::uint32_t operator()() const { return leaves != nullptr && *leaves < capacity ? *leaves : capacity; }
  /// ParentedTree::leaves: leaf k has this number + k.
  HIPRT_HD std::uint32_t first_leaf() const {
    const std::uint32_t n = (*this)();
    return n + (kCycle / 2 - n) % kCycle;
  }
};

/// While nodes move, nothing is summed up.
struct ShapeTree {
  LinkedTree<ReferenceLeaves, NoSums> tree;
  TreeSize size;
  std::uint32_t* parents;  ///< [2 first_leaf()]: kInvalidId where there is none.
  std::uint32_t* height;   ///< RefitStep::height after a round; 0 before. nullptr without rounds.
  std::uint32_t* rounds;   ///< How many there may be. nullptr without rounds.
  std::uint32_t most_height;

  /// Whether a round comes too late.
  HIPRT_HD bool ended(unsigned round) const { return *height > most_height || round >= *rounds; }
  HIPRT_HD ParentedTree<LinkedTree<ReferenceLeaves, NoSums>> parented() const {
    return {tree, size.first_leaf(), parents};
  }
};
using Shape = LinkedTree<ReferenceLeaves, NoSums>;

/// Nodes are numbered from 1 on.
inline __device__ bool has_node(const LinkedNode* nodes, std::uint32_t i) {
  return i != 0 && nodes[i].child[0] != kInvalidId;
}

static __global__ void __launch_bounds__(kBlock) set_parents(ShapeTree shape) {
  const std::uint32_t i = thread_index();
  if (i < shape.size() && has_node(shape.tree.nodes, i)) SetParentsStep<Shape>{shape.parented()}(i - 1);
}

/// The children of an inner node.
struct NodeLinks {
  LinkedRef child[2];
};

static __global__ void __launch_bounds__(kBlock)
    start_rounds(ShapeTree shape, NodeLinks* before, unsigned rounds, const std::uint32_t* references) {
  const std::uint32_t i = thread_index();
  if (i == 0) {
    *shape.height = 0;
    *shape.rounds = references != nullptr ? usual_rounds(rounds, *references, shape.size()) : rounds;
  }
  if (i >= shape.size()) return;
  const LinkedNode& node = shape.tree.nodes[i];
  before[i] = NodeLinks{{node.child[0], node.child[1]}};
}
static __global__ void __launch_bounds__(kBlock)
    find_reinsertions(ShapeTree shape, unsigned round, Lookers lookers, std::uint32_t looking, Reinsertion* found) {
  const std::uint32_t i = thread_index();
  if (i >= looking) return;
  if (shape.ended(round))
    found[i] = Reinsertion{0.0f, kInvalidId, kInvalidId};
  else
    FindReinsertionStep<Shape>{shape.parented(), lookers, found}(i);
}
static __global__ void __launch_bounds__(kBlock)
    bid_for_reinsertions(ShapeTree shape, Lookers lookers, std::uint32_t looking, const Reinsertion* found,
                         ReinsertionBids* bids) {
  const std::uint32_t i = thread_index();
  if (i < looking) BidReinsertionStep<Shape>{shape.parented(), lookers, found, bids}(i);
}
static __global__ void __launch_bounds__(kBlock)
    grant_reinsertions(ShapeTree shape, Lookers lookers, std::uint32_t looking, const Reinsertion* found,
                       const ReinsertionBids* bids, std::uint8_t* granted) {
  const std::uint32_t i = thread_index();
  if (i < looking) GrantReinsertionStep<Shape>{shape.parented(), lookers, found, bids, granted}(i);
}
static __global__ void __launch_bounds__(kBlock)
    apply_reinsertions(ShapeTree shape, Lookers lookers, std::uint32_t looking, const Reinsertion* found,
                       const std::uint8_t* granted) {
  const std::uint32_t i = thread_index();
  if (i < looking) ReinsertStep<Shape>{shape.parented(), lookers, found, granted}(i);
}
/// Boxes of all nodes. @param met per node: 0.
static __global__ void __launch_bounds__(kBlock) refit_round(ShapeTree shape, unsigned round, std::uint32_t* met) {
  const std::uint32_t i = thread_index();
  if (i < shape.size() && !shape.ended(round)) RefitStep<Shape>{shape.parented(), met, shape.height}(i);
}

/// Boxes and plans of all nodes. @param met per node: 0.
static __global__ void __launch_bounds__(kBlock)
    refit_tree(PlannedTree tree, TreeSize size, std::uint32_t* parents, std::uint32_t* met) {
  const std::uint32_t i = thread_index();
  if (i < size()) RefitStep<PlannedTree>{{tree, size.first_leaf(), parents}, met}(i);
}

/// Whether the tree needs more stack entries than a file may say.
inline __device__ bool is_too_deep(const PlannedTree& tree) {
  const LinkedRef root = *tree.root;
  return root != kInvalidId && (root & kLinkedLeaf) == 0 && tree.sums.plans[root].need > kMaxStackBound;
}

static __global__ void note_depth(PlannedTree tree, std::uint32_t* too_deep) { *too_deep = is_too_deep(tree) ? 1 : 0; }

/// A tree that is too deep becomes again what it was: its links, their parents, its boxes and plans.
static __global__ void __launch_bounds__(kBlock)
    restore_links(ShapeTree shape, const NodeLinks* before, std::uint32_t* met, const std::uint32_t* too_deep) {
  const std::uint32_t i = thread_index();
  if (i >= shape.size() || *too_deep == 0) return;
  for (unsigned side = 0; side < 2; ++side) shape.tree.nodes[i].child[side] = before[i].child[side];
  met[i] = 0;
  shape.parents[i] = shape.parents[shape.size.first_leaf() + i] = kInvalidId;
}
static __global__ void __launch_bounds__(kBlock) restore_parents(ShapeTree shape, const std::uint32_t* too_deep) {
  const std::uint32_t i = thread_index();
  if (i < shape.size() && *too_deep != 0 && has_node(shape.tree.nodes, i))
    SetParentsStep<Shape>{shape.parented()}(i - 1);
}
static __global__ void __launch_bounds__(kBlock) restore_plans(PlannedTree tree, TreeSize size, std::uint32_t* parents,
                                                               std::uint32_t* met, const std::uint32_t* too_deep) {
  const std::uint32_t i = thread_index();
  if (i < size() && *too_deep != 0) RefitStep<PlannedTree>{{tree, size.first_leaf(), parents}, met}(i);
}

}  // namespace hiprt::build::kernels
