#pragma once
/// The hierarchy of Morton codes as a tree: topology and boxes in one pass. Internal.

#include <hiprt_build/lbvh_ploc/climb.h>
#include <hiprt_build/tree/binary_tree.h>

namespace hiprt::build {

/// Step: climbs from leaf i, and joins at every node to which it comes second. Node k cuts between leaves k - 1 and k.
/// @tparam Tree a LinkedTree.
template <class Tree> struct LbvhStep {
  Tree tree;
  std::uint32_t leaves;
  const std::uint8_t* levels;
  std::uint32_t* met;

  HIPRT_HD void operator()(std::size_t i) const {
    Climb climb(static_cast<std::uint32_t>(i));
    LinkedRef mine = climb.first | kLinkedLeaf;
    Box box = tree.leaves.box(climb.first);
    const auto leave_reference = [&](std::uint32_t boundary, bool left) {
      tree.nodes[boundary + 1].child[left ? 0 : 1] = mine;
    };
    while (climb.count() < leaves) {
      const std::uint32_t boundary = climb.up(leaves, levels, met, leave_reference);
      if (boundary == kInvalidId) return;
      const std::uint32_t node = boundary + 1;
      const LinkedRef left = tree.nodes[node].child[0], right = tree.nodes[node].child[1];
      grow(box, tree.box(left == mine ? right : left));
      tree.join(node, left, right, box);
      mine = node;
    }
    *tree.root = mine;
  }
};

}  // namespace hiprt::build
