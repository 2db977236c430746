#pragma once
/// The wide tree over a binary tree in depth-first order; see collapse_plan.h. Internal.

#include <hiprt_build/build.h>
#include <hiprt_build/collapse/wide_children.h>
#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/tree/binary_tree.h>

#include <array>

namespace hiprt::build {

/// The wide tree over a binary tree.
class WideTree {
 public:
  /// @param max_primitives as CollapseCosts.
  WideTree(CpuEngine& engine, const DepthFirstTree& tree, const SahCosts& costs, unsigned max_primitives);

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

  /// The binary tree with its plans, as WideChildren reads it.
  bool is_leaf(std::uint32_t node) const { return tree_.nodes[node].count == 1; }
  std::uint32_t child(std::uint32_t node, unsigned side) const {
    return side == 0 ? tree_.left(node) : tree_.right(node);
  }
  const CollapsePlan& plan(std::uint32_t node) const { return plan_[node]; }
  std::uint32_t leaf_count(std::uint32_t node) const { return tree_.nodes[node].count; }

 private:
  void make_plan(std::uint32_t node);

  CpuEngine& engine_;
  const DepthFirstTree& tree_;
  CollapseCosts costs_;
  ScratchArray<CollapsePlan> plan_;
};

}  // namespace hiprt::build
