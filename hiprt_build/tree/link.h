#pragma once
/// Nodes in depth-first order as a linked tree's. Internal.

#include <hiprt_build/tree/binary_tree.h>

#include <span>

namespace hiprt::build {

/// Step: node i of a depth-first tree (DepthFirstNode) in the linked one over the same references.
struct LinkNodeStep {
  std::span<const DepthFirstNode> tree;
  std::uint32_t first;  ///< The linked tree's number of the tree's first reference.
  std::span<LinkedNode> nodes;
  std::span<std::uint32_t> counts;

  std::uint32_t right(std::uint32_t node) const { return node + 2 * tree[node + 1].count; }
  /// The linked tree's number of a node: of an inner one where its right half begins, which no two share.
  LinkedRef ref(std::uint32_t node) const {
    if (tree[node].count == 1) return (first + tree[node].first) | kLinkedLeaf;
    return first + tree[right(node)].first;
  }
  void operator()(std::size_t i) const {
    const auto node = static_cast<std::uint32_t>(i);
    if (tree[node].count == 1) return;
    nodes[ref(node)] = LinkedNode{tree[node].box, {ref(node + 1), ref(right(node))}};
    counts[ref(node)] = tree[node].count;
  }
};

}  // namespace hiprt::build
