#pragma once
/// Boxes of a tree whose leaves or whose shape have changed. Internal.

#include <hiprt_build/tree/binary_tree.h>
#include <hiprt_device/math/atomic.h>

namespace hiprt::build {

/// A linked tree that also knows the way up.
template <class Tree> struct ParentedTree {
  Tree tree;
  std::uint32_t leaves;
  std::uint32_t* parents;  ///< Of inner node k: [k]; of leaf k: [leaves + k]. kInvalidId for the root.

  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t& parent(LinkedRef ref) const {
    return parents[(ref & kLinkedLeaf) != 0 ? leaves + (ref & ~kLinkedLeaf) : ref];
  }
  /// @pre ref is not the root.
  HIPRT_HD HIPRT_FORCE_INLINE LinkedRef sibling(LinkedRef ref) const {
    const LinkedNode& above = tree.nodes[parent(ref)];
    return above.child[0] == ref ? above.child[1] : above.child[0];
  }
  /// One child of a node becomes another.
  HIPRT_HD HIPRT_FORCE_INLINE void replace_child(std::uint32_t node, LinkedRef before, LinkedRef after) const {
    LinkedRef* child = tree.nodes[node].child;
    child[child[0] == before ? 0 : 1] = after;
    parent(after) = node;
  }
};

/// Step: tells the children of inner node i + 1 of it.
template <class Tree> struct SetParentsStep {
  ParentedTree<Tree> tree;

  HIPRT_HD void operator()(std::size_t i) const {
    const auto node = static_cast<std::uint32_t>(i + 1);
    for (const LinkedRef child : tree.tree.nodes[node].child) tree.parent(child) = node;
  }
};

/// Step: climbs from leaf i; whoever comes second to a node makes its box and sums from those of its children.
template <class Tree> struct RefitStep {
  ParentedTree<Tree> tree;
  std::uint32_t* met;               ///< Per inner node: 0 before. Then the nodes below that child which came first.
  std::uint32_t* height = nullptr;  ///< Where to write how many nodes the longest path has, a leaf included.

  HIPRT_HD void operator()(std::size_t i) const {
    std::uint32_t node = tree.parents[tree.leaves + i], below = 1;
    if (node == kInvalidId) return;
    do {
      const std::uint32_t first = exchange(&met[node], below);
      if (first == 0) return;
      below = 1 + (first > below ? first : below);
      const LinkedRef left = tree.tree.nodes[node].child[0], right = tree.tree.nodes[node].child[1];
      tree.tree.join(node, left, right, unite(tree.tree.box(left), tree.tree.box(right)));
      node = tree.parents[node];
    } while (node != kInvalidId);
    if (height != nullptr) *height = below;
  }
};

}  // namespace hiprt::build
