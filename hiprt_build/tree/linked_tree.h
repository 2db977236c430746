#pragma once
/// Binary trees as bottom-up builders make them: nodes in any order, with references to their children. Internal.

#include <hiprt_build/tree/box.h>

#include <cstdint>

namespace hiprt::build {

/// An inner node's number, 1 to leaves - 1, or a leaf's, 0 to leaves - 1, with kLinkedLeaf set.
using LinkedRef = std::uint32_t;
inline constexpr LinkedRef kLinkedLeaf = 0x80000000u;

struct alignas(32) LinkedNode {
  Box box;
  LinkedRef child[2];
};
static_assert(sizeof(LinkedNode) == 32);

/// What is known of a subtree besides its box: how many leaves it has.
struct LeafCounts {
  std::uint32_t* counts;  ///< Leaves below each inner node.

  HIPRT_HD HIPRT_INLINE std::uint32_t count(LinkedRef ref) const { return (ref & kLinkedLeaf) != 0 ? 1u : counts[ref]; }
  HIPRT_HD HIPRT_INLINE void join(std::uint32_t node, LinkedRef left, LinkedRef right, const Box&) const {
    counts[node] = count(left) + count(right);
  }
};

/// Nothing is asked of subtrees but their boxes.
struct NoSums {
  HIPRT_HD HIPRT_INLINE void join(std::uint32_t, LinkedRef, LinkedRef, const Box&) const {}
};

/// A tree while it grows. Whoever joins two subtrees has seen both: see climb.h for the order of memory.
/// @tparam LeafBoxes has Box box(leaf) const.
/// @tparam SubtreeSums has join(node, left, right, box) const: told of every node once both of its children are there.
template <class LeafBoxes, class SubtreeSums = LeafCounts> struct LinkedTree {
  LeafBoxes leaves;
  LinkedNode* nodes;
  SubtreeSums sums;
  LinkedRef* root;

  HIPRT_HD HIPRT_INLINE Box box(LinkedRef ref) const {
    return (ref & kLinkedLeaf) != 0 ? leaves.box(ref & ~kLinkedLeaf) : nodes[ref].box;
  }
  /// Writes inner node @p node over two subtrees. @param box of both.
  HIPRT_HD HIPRT_INLINE void join(std::uint32_t node, LinkedRef left, LinkedRef right, const Box& box) const {
    nodes[node] = LinkedNode{box, {left, right}};
    sums.join(node, left, right, box);
  }
};

}  // namespace hiprt::build
