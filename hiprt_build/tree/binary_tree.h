#pragma once
/// What every tree builder takes and makes: references in, a binary tree out. Internal.

#include <hiprt_build/exec/scratch.h>
#include <hiprt_build/tree/aabb.h>

#include <cstdint>
#include <cstring>

namespace hiprt::build {

inline Float4 load4(const float* p) {
  Float4 result;
  std::memcpy(&result, p, sizeof(result));
  return result;
}

/// A box that holds (a part of) a leaf's primitives. Laid out as RTCBuildPrimitive.
struct alignas(32) Reference {
  float min[3];
  std::uint32_t reserved;  ///< Zero; Embree keeps a split count here while it builds.
  float max[3];
  std::uint32_t leaf;  ///< Index of the PrimitiveGroup.

  Aabb box() const { return Aabb{load4(min), load4(max)}; }
  Box as_box() const { return Box{{min[0], min[1], min[2]}, {max[0], max[1], max[2]}}; }
};
static_assert(sizeof(Reference) == 32);

inline Reference make_reference(const Aabb& box, std::uint32_t leaf) {
  return Reference{{box.min[0], box.min[1], box.min[2]}, 0, {box.max[0], box.max[1], box.max[2]}, leaf};
}

/// Leaves of a linked tree.
struct ReferenceLeaves {
  const Reference* references;
  Box box(std::uint32_t leaf) const { return references[leaf].as_box(); }
};

/// A node over the references [first, first + count). Leaf iff count == 1.
/// In depth-first order with room: the left child of node i is i + 1, the right one i + 2 * (count of the left), so a
/// subtree of n references owns the 2 n - 1 nodes from its root on, wherever the splits fall.
struct alignas(32) BinaryNode {
  float min[3];
  std::uint32_t first;
  float max[3];
  std::uint32_t count;

  Aabb box() const { return Aabb{load4(min), load4(max)}; }
};
static_assert(sizeof(BinaryNode) == 32);

inline BinaryNode make_node(const Aabb& box, std::uint32_t first, std::uint32_t count) {
  return BinaryNode{{box.min[0], box.min[1], box.min[2]}, first, {box.max[0], box.max[1], box.max[2]}, count};
}

struct BinaryTree {
  ScratchArray<Reference> references;  ///< In the order of the tree's leaves.
  ScratchArray<BinaryNode> nodes;      ///< 2 * references - 1, or none.

  bool empty() const { return references.size() == 0; }
  std::uint32_t left(std::uint32_t node) const { return node + 1; }
  std::uint32_t right(std::uint32_t node) const { return node + 2 * nodes[node + 1].count; }
};

/// Longest path of a binary tree that builders make: beyond it they halve by count. With at most three stacked siblings
/// per level a traversal needs at most 3 * kMaxDepth entries.
inline constexpr unsigned kMaxDepth = 60;

}  // namespace hiprt::build
