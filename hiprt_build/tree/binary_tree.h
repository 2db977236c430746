#pragma once
/// The two forms of a binary tree over references. Internal.
///
/// LinkedTree: nodes in any order that refer to their children, as bottom-up builders and reinsertion make them, on the
/// host and on devices. DepthFirstTree: nodes in depth-first order without links, as top-down builders of the host make
/// them and collapse and encoding read them. link.h and flatten.h convert one into the other.

#include <hiprt_build/exec/scratch.h>
#include <hiprt_build/input/leaf.h>
#include <hiprt_build/tree/box.h>

#include <cstdint>

namespace hiprt::build {

/// Longest path of a binary tree. Builders halve deeper subtrees by count.
inline constexpr unsigned kMaxDepth = 60;
/// Most stack entries that a traversal of a file may need: three siblings on each level of a binary tree.
inline constexpr std::uint32_t kMaxStackBound = 3 * kMaxDepth;

/// An inner node's number, 1 to leaves - 1, or a leaf's, 0 to leaves - 1, with kLinkedLeaf set.
using LinkedRef = std::uint32_t;
inline constexpr LinkedRef kLinkedLeaf = 0x80000000u;

struct alignas(32) LinkedNode {
  Box box;
  LinkedRef child[2];
};
static_assert(sizeof(LinkedNode) == 32);

/// Subtree sums: the number of leaves.
struct LeafCounts {
  std::uint32_t* counts;  ///< Leaves below each inner node.

  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t count(LinkedRef ref) const {
    return (ref & kLinkedLeaf) != 0 ? 1u : counts[ref];
  }
  HIPRT_HD HIPRT_FORCE_INLINE void join(std::uint32_t node, LinkedRef left, LinkedRef right, const Box&) const {
    counts[node] = count(left) + count(right);
  }
};

/// Subtree sums: none.
struct NoSums {
  HIPRT_HD HIPRT_FORCE_INLINE void join(std::uint32_t, LinkedRef, LinkedRef, const Box&) const {}
};

/// Leaves of a linked tree: references by number.
struct ReferenceLeaves {
  const Reference* references;

  HIPRT_HD HIPRT_FORCE_INLINE Box box(std::uint32_t leaf) const { return references[leaf].box; }
#if !HIPRT_DEVICE_CODE
  FastBox fast_box(std::uint32_t leaf) const { return FastBox{simd_box(references[leaf])}; }
#endif
};

/// A tree while it grows. The thread that joins two subtrees has seen both: climb.h says in which order of memory.
/// @tparam LeafBoxes has Box box(leaf) const; and FastBox fast_box(leaf) const, for reinsertion.
/// @tparam SubtreeSums has join(node, left, right, box) const, called for every node after both of its children.
template <class LeafBoxes, class SubtreeSums = LeafCounts> struct LinkedTree {
  LeafBoxes leaves;
  LinkedNode* nodes;
  SubtreeSums sums;
  LinkedRef* root;

  HIPRT_HD HIPRT_FORCE_INLINE Box box(LinkedRef ref) const {
    return (ref & kLinkedLeaf) != 0 ? leaves.box(ref & ~kLinkedLeaf) : nodes[ref].box;
  }
#if HIPRT_DEVICE_CODE
  HIPRT_HD HIPRT_FORCE_INLINE FastBox fast_box(LinkedRef ref) const { return FastBox{box(ref)}; }
  HIPRT_HD HIPRT_FORCE_INLINE FastBox node_box(std::uint32_t node) const { return FastBox{nodes[node].box}; }
#else
  FastBox fast_box(LinkedRef ref) const {
    return (ref & kLinkedLeaf) != 0 ? leaves.fast_box(ref & ~kLinkedLeaf) : node_box(ref);
  }
  FastBox node_box(std::uint32_t node) const { return FastBox{simd_box(nodes[node])}; }
#endif
  /// Writes inner node @p node over two subtrees. @param box of both.
  HIPRT_HD HIPRT_FORCE_INLINE void join(std::uint32_t node, LinkedRef left, LinkedRef right, const Box& box) const {
    nodes[node] = LinkedNode{box, {left, right}};
    sums.join(node, left, right, box);
  }
};

/// A node over the references [first, first + count). It is a leaf if count is 1.
/// The left child of node i is node i + 1, the right one node i + 2 * (count of the left). So a subtree of n references
/// owns the 2 n - 1 nodes from its root on, wherever the splits fall.
struct alignas(32) DepthFirstNode {
  Box box;
  std::uint32_t first;
  std::uint32_t count;
};
static_assert(sizeof(DepthFirstNode) == 32);

struct DepthFirstTree {
  ScratchArray<Reference> references;  ///< In the order of the tree's leaves.
  ScratchArray<DepthFirstNode> nodes;  ///< 2 * references - 1, or none.

  bool empty() const { return references.size() == 0; }
  std::uint32_t left(std::uint32_t node) const { return node + 1; }
  std::uint32_t right(std::uint32_t node) const { return node + 2 * nodes[node + 1].count; }
};

}  // namespace hiprt::build
