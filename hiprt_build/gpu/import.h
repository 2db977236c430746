#pragma once
/// Scenes from trees of other builders, in device memory. The host does not wait.
///
///     hiprt::gpu::DeviceTree tree{.nodes = nodes, .leaves = leaves, .leaf_count = n};
///     auto sizes = hiprt::gpu::import_sizes(mesh, tree);
///     auto report = hiprt::gpu::enqueue_import(mesh, tree, {}, output, scratch, stream);

#include <hiprt_build/gpu/build.h>

#include <cstdint>

namespace hiprt::gpu {

/// An inner node of a binary tree, in the form of HIPRT's hiprtInternalNode.
struct alignas(64) ImportedNode {
  float min[3], max[3];      ///< Not read: boxes are computed again from those of the leaves.
  std::uint32_t child[2];    ///< Numbers of nodes or leaves.
  std::uint32_t is_leaf[2];  ///< Of each child: 0 a node, 1 a leaf.
};

/// A leaf, in the form of HIPRT's hiprtLeafNode.
struct alignas(32) ImportedLeaf {
  /// Read only if the primitive has several leaves (spatial splits): then their boxes must cover it together.
  float min[3], max[3];
  /// Number of the triangle or box; of the pair if the geometry has pairs.
  std::uint32_t primitive;
};

static_assert(sizeof(ImportedNode) == 64 && sizeof(ImportedLeaf) == 32);

/// A binary tree in device memory. Node 0 is the root. Every other node and every leaf is the child of one node.
struct DeviceTree {
  const ImportedNode* nodes = nullptr;  ///< leaf_count - 1 of them.
  const ImportedLeaf* leaves = nullptr;
  std::uint32_t leaf_count = 0;  ///< At least 1, unless the geometry is empty. At most kMaxBuildPrimitives.
};

/// @param options as for a build. builder, budgets and pair_triangles are ignored.
Result<BuildSizes> import_sizes(const DeviceGeometry& geometry, const DeviceTree& tree,
                                const BuildOptions& options = {});

/// As enqueue_build(), with the tree of the caller. The tree is only read. A primitive without a leaf is never hit, and
/// BuildReport::missing counts it. Leaves of dropped primitives are left out.
/// @return where the report will be. Its status is kBadTree if the nodes do not form a tree.
Result<const BuildReport*> enqueue_import(const DeviceGeometry& geometry, const DeviceTree& tree,
                                          const BuildOptions& options, std::byte* output, std::byte* scratch,
                                          hipStream_t stream);

}  // namespace hiprt::gpu
