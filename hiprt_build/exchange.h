#pragma once
/// Trees of other programs in, trees of BVH files out: a plain exchange form (nodes whose children lie side by side, as
/// in madmann91/bvh, with two to four of them).
///
///     hiprt::build::ExchangeBvh tree = ...;  // Of a builder of yours.
///     auto bvh = hiprt::build::import_tree({.meshes = meshes}, tree);
///     if (!bvh) std::cerr << bvh.error().message;

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>

#include <vector>

namespace hiprt::build {

/// An inner node has children, a leaf has primitives; no node has both.
struct ExchangeNode {
  Box box;                       ///< Holds the boxes of the children, or the primitives.
  std::uint32_t first = 0;       ///< Of the children in ExchangeBvh::nodes, or of the entries in primitives.
  std::uint32_t children = 0;    ///< 2 to 4, or 0: nodes [first, first + children).
  std::uint32_t primitives = 0;  ///< 0 if there are children: entries [first, first + primitives).
};

/// nodes[0] is the root; every other node is one node's child, in any order. A tree over no primitives has no nodes.
struct ExchangeBvh {
  std::vector<ExchangeNode> nodes;
  /// What leaves refer to; every entry is in one leaf. Primitives are numbered over all geometries, meshes first,
  /// geometry by geometry. A primitive may be in several leaves (spatial splits), once in each.
  std::vector<std::uint32_t> primitives;
};

/// Whether @p tree is a tree over @p scene: every node reached from the root once; numbers in range; boxes finite, and
/// min <= max; every box exactly inside its parent's; a primitive that is in one leaf exactly inside the leaf's box (of
/// one in several leaves each box may hold a part); every primitive in a leaf, but for those that input.h says are
/// dropped, which may be anywhere or nowhere. Takes time proportional to the sizes of both (sorts what is in several
/// leaves), whatever the tree's depth.
/// @return the first thing that is wrong, with the numbers of node, child and primitive: kInvalidInput, or kTooLarge
/// where numbers of 32 bits do not reach.
HIPRT_BUILD_API Result<void> validate(const ExchangeBvh& tree, const SceneInput& scene);

/// Builds a BVH of @p tree as others are built from their builder's trees: triangles of the same leaves are paired;
/// leaves with more than one pair are split by the surface area heuristic, nodes with more than two children by pairs
/// of the nearest; then reinsertion (BuildOptions::reinsertion_rounds), optimal collapse to four children and encoding.
///
/// Hits never depend on the tree: boxes are made again from the primitives. A triangle in several leaves is cut between
/// them by planes that separate their boxes, and is whole in one of them where there is no such plane, as custom
/// primitives are. Where the tree is deeper than about 60 levels, subtrees are balanced instead.
/// @param options builder and budgets are ignored.
/// @return the errors of validate() and build(). Statistics say Builder::kImported.
HIPRT_BUILD_API Result<Bvh> import_tree(const SceneInput& scene, const ExchangeBvh& tree,
                                        const BuildOptions& options = {});

/// The tree of a file: nodes of two to four children, a leaf for each run of leaves, boxes as the file states them
/// (layouts half and quantized: rounded outwards; infinite planes are the file's bounds). validate() accepts it
/// together with the scene that the file was built from.
/// @return kInvalidInput with what hiprt::validate() says, kTooLarge if there are 2^31 primitives or more,
/// kOutOfMemory.
HIPRT_BUILD_API Result<ExchangeBvh> export_tree(const BufferView& file);

}  // namespace hiprt::build
