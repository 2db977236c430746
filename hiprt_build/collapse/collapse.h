#pragma once
/// The wide tree over a binary tree in depth-first order; see collapse_plan.h. Internal.

#include <hiprt_build/build.h>
#include <hiprt_build/collapse/collapse_plan.h>
#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/input/geometry.h>
#include <hiprt_build/tree/binary_tree.h>

#include <array>

namespace hiprt::build {

/// The wide tree over a binary tree.
class WideTree {
 public:
  /// @param groups what the tree's references refer to.
  /// @param max_primitives as CollapseCosts.
  WideTree(CpuEngine& engine, const BinaryTree& tree, std::span<const PrimitiveGroup> groups, const SahCosts& costs,
           unsigned max_primitives);

  struct Children {
    std::array<std::uint32_t, kBranching> node{};  ///< Binary nodes.
    unsigned count = 0;
  };

  /// Whether the binary node becomes a run of leaves (over its references) where it is one child. All leaves of a run
  /// are of one kind.
  bool is_run(std::uint32_t node) const { return plan_[node].is_run(); }
  /// Whether all leaves below are of custom primitives.
  bool is_custom(std::uint32_t node) const { return plan_[node].is_custom(); }
  /// Wide nodes of its subtree where it is one child.
  std::uint32_t node_count(std::uint32_t node) const { return plan_[node].nodes; }
  /// Surface area cost of the whole tree, relative to the root's area.
  double cost() const;
  /// @pre !is_run(node)
  Children children(std::uint32_t node) const;

 private:
  void plan(std::uint32_t node);
  void gather(std::uint32_t node, unsigned slots, Children& result) const;

  CpuEngine& engine_;
  const BinaryTree& tree_;
  std::span<const PrimitiveGroup> groups_;
  CollapseCosts costs_;
  ScratchArray<CollapsePlan> plan_;
};

}  // namespace hiprt::build
