#pragma once
/// A caller's tree, and the memory that its import needs. Internal.

#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/gpu/import.h>
#include <hiprt_build/tree/binary_tree.h>

namespace hiprt::build {

/// A tree, and the memory that its import needs.
struct GpuImport {
  gpu::DeviceTree tree;
  const TrianglePair* pairs;  ///< nullptr: leaves name primitives.
  std::uint32_t pair_count;
  std::uint32_t primitives;
  const Reference* references;  ///< Of all primitives; of a joined pair that of the lower triangle.
  // Scratch.
  std::uint32_t* uses;     ///< Per primitive: its leaves.
  std::uint32_t* parents;  ///< Of the nodes, then of the leaves; kInvalidId: none.
  std::uint32_t* met;      ///< Per node: children that are done.
  std::uint32_t* below;    ///< Per node: leaves below it.
  // Result.
  Reference* leaves;  ///< slots() per leaf; without contents where there is none.
  LinkedNode* nodes;  ///< As many. Node k of the tree is number k + 1; those from leaf_count on join separate pairs.

  /// A pair whose triangles cannot share a leaf needs two.
  HIPRT_HD std::uint32_t slots() const { return pairs == nullptr ? 1 : 2; }
  HIPRT_HD std::uint32_t capacity() const { return slots() * tree.leaf_count; }
  static void take(gpu::Arena& arena, std::uint32_t primitives, std::uint32_t leaves, GpuImport& job) {
    job.uses = arena.take<std::uint32_t>(primitives);
    job.parents = arena.take<std::uint32_t>(2 * std::uint64_t{leaves});
    job.met = arena.take<std::uint32_t>(leaves);
    job.below = arena.take<std::uint32_t>(leaves);
  }

  /// The references of a leaf: one or two.
  struct Named {
    std::uint32_t reference[2];  ///< kInvalidId: none.
    bool exists;
  };
  HIPRT_HD Named named(std::uint32_t leaf) const {
    const std::uint32_t number = tree.leaves[leaf].primitive;
    if (pairs == nullptr) return {{number, kInvalidId}, number < primitives};
    if (number >= pair_count) return {{kInvalidId, kInvalidId}, false};
    const std::uint32_t a = pairs[number][0], b = pairs[number][1], low = a < b ? a : b, high = a < b ? b : a;
    if (high >= primitives) return {{kInvalidId, kInvalidId}, false};
    const LeafContents contents = references[low].contents;
    const bool joined = low == high || (contents.exists() && contents.distance() == high - low);
    return {{low, joined ? kInvalidId : high}, true};
  }

  HIPRT_HD LinkedRef link_of_leaf(std::uint32_t leaf) const {
    const std::uint32_t first = slots() * leaf;
    const bool one = leaves[first].contents.exists(), two = slots() == 2 && leaves[first + 1].contents.exists();
    if (one && two) return tree.leaf_count + leaf;
    return one ? first | kLinkedLeaf : two ? (first + 1) | kLinkedLeaf : kInvalidId;
  }

  /// The box of a leaf's part of a primitive.
  HIPRT_HD Box part_box(std::uint32_t leaf, const Reference& whole, std::uint32_t leaves_of_it) const {
    if (leaves_of_it < 2) return whole.box;
    const gpu::ImportedLeaf& given = tree.leaves[leaf];
    Box box = whole.box;
    bool ordered = true;
    for (unsigned axis = 0; axis < 3; ++axis) {
      if (given.min[axis] > box.min[axis]) box.min[axis] = given.min[axis];
      if (given.max[axis] < box.max[axis]) box.max[axis] = given.max[axis];
      ordered = ordered && box.min[axis] <= box.max[axis];
    }
    return ordered ? box : whole.box;
  }
};

}  // namespace hiprt::build
