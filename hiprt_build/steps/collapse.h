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
  std::uint8_t triangles;  ///< Below the node; 255: that many or more.
};

/// The wide tree over a binary tree.
class WideTree {
 public:
  /// @param groups what the tree's references refer to.
  /// @param max_triangles most triangles in a run of several leaves, below 255. (A single leaf is always a run.)
  WideTree(CpuEngine& engine, const BinaryTree& tree, std::span<const TriangleGroup> groups, const SahCosts& costs,
           unsigned max_triangles);

  struct Children {
    std::array<std::uint32_t, kBranching> node{};  ///< Binary nodes.
    unsigned count = 0;
  };

  /// Whether the binary node becomes a run of leaves (over its references) where it is one child.
  bool is_run(std::uint32_t node) const { return tree_.nodes[node].count == 1 || plan_[node].choice[0] == 0; }
  /// Wide nodes of its subtree where it is one child.
  std::uint32_t node_count(std::uint32_t node) const { return plan_[node].nodes[0]; }
  /// Surface area cost of the whole tree, relative to the root's area.
  double cost() const;
  /// @pre !is_run(node)
  Children children(std::uint32_t node) const;

 private:
  void plan(std::uint32_t node);
  void plan_inner(std::uint32_t node);
  void gather(std::uint32_t node, unsigned slots, Children& result) const;

  CpuEngine& engine_;
  const BinaryTree& tree_;
  std::span<const TriangleGroup> groups_;
  SahCosts costs_;
  unsigned max_triangles_;
  ScratchArray<CollapsePlan> plan_;
};

}  // namespace hiprt::build
