#pragma once
/// Binary tree to four-wide tree with the lowest surface area cost, by dynamic programming (Ylitie, Karras, Laine,
/// "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", 2017, section 3.2). Internal.

#include <hiprt_build/build.h>
#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/steps/binary_tree.h>
#include <hiprt_build/steps/geometry.h>

#include <array>

namespace hiprt::build {

/// How the subtree of a binary node is best shown as 1, 2 or 3 children of a wide node.
struct CollapsePlan {
  float cost[3];           ///< [i]: least cost as i + 1 children.
  std::uint32_t nodes[3];  ///< [i]: wide nodes in that forest.
  /// choice[0]: 0 a run of leaves, else a wide node whose first k of four children come from the left child.
  /// choice[i]: 0 as with one child less, else k of the i + 1 children come from the left.
  std::uint8_t choice[3];
  std::uint8_t primitives;  ///< Below the node; 255: that many or more, or both triangles and custom ones.
};

/// The wide tree over a binary tree.
class WideTree {
 public:
  /// @param groups what the tree's references refer to.
  /// @param max_primitives most triangles or custom primitives in a run of several leaves, below 255. (A single leaf is
  ///        always a run.)
  WideTree(CpuEngine& engine, const BinaryTree& tree, std::span<const PrimitiveGroup> groups, const SahCosts& costs,
           unsigned max_primitives);

  struct Children {
    std::array<std::uint32_t, kBranching> node{};  ///< Binary nodes.
    unsigned count = 0;
  };

  /// Whether the binary node becomes a run of leaves (over its references) where it is one child. All leaves of a run
  /// are of one kind.
  bool is_run(std::uint32_t node) const { return tree_.nodes[node].count == 1 || plan_[node].choice[0] == 0; }
  /// Whether the node's first leaf, and so the run that it may be, is of custom primitives.
  bool is_custom(std::uint32_t node) const {
    return groups_[tree_.references[tree_.nodes[node].first].leaf].is_custom();
  }
  /// Wide nodes of its subtree where it is one child.
  std::uint32_t node_count(std::uint32_t node) const { return plan_[node].nodes[0]; }
  /// Surface area cost of the whole tree, relative to the root's area.
  double cost() const;
  /// @pre !is_run(node)
  Children children(std::uint32_t node) const;

 private:
  void plan(std::uint32_t node);
  void plan_inner(std::uint32_t node);
  std::uint8_t count_primitives(std::uint32_t node) const;
  float leaf_cost(std::uint32_t node) const { return is_custom(node) ? costs_.custom : costs_.leaf; }
  void gather(std::uint32_t node, unsigned slots, Children& result) const;

  CpuEngine& engine_;
  const BinaryTree& tree_;
  std::span<const PrimitiveGroup> groups_;
  SahCosts costs_;
  unsigned max_primitives_;
  ScratchArray<CollapsePlan> plan_;
};

}  // namespace hiprt::build
