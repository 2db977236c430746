#pragma once
/// Imports trees of other programs and exports the trees of BVH files. Both use a plain form, as in madmann91/bvh: a
/// node has two to four children, which lie side by side.
///
///     hiprt::build::ExchangeBvh tree = ...;  // From your own builder.
///     auto bvh = hiprt::build::import_tree({.meshes = meshes}, tree);
///     if (!bvh) std::cerr << bvh.error().message;

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>

#include <vector>

namespace hiprt::build {

/// An inner node has children, a leaf has primitives; no node has both.
struct ExchangeNode {
  Box box;                       ///< Contains the boxes of the children, or the primitives.
  std::uint32_t first = 0;       ///< The first child in ExchangeBvh::nodes, or the first entry in primitives.
  std::uint32_t children = 0;    ///< 2 to 4, or 0: nodes [first, first + children).
  std::uint32_t primitives = 0;  ///< 0 if there are children: entries [first, first + primitives).
};

/// nodes[0] is the root. Every other node is the child of exactly one node, in any order. A tree over no primitives has
/// no nodes.
struct ExchangeBvh {
  std::vector<ExchangeNode> nodes;
  /// The primitives of the leaves. Every entry belongs to one leaf. Primitives are numbered over all geometries, meshes
  /// first. A primitive may be in several leaves (spatial splits), once in each.
  std::vector<std::uint32_t> primitives;
};

/// Checks that @p tree is a tree over @p scene:
/// - every node is reached from the root exactly once, and all numbers are in range;
/// - boxes are finite, with min <= max, and lie exactly inside their parent's box;
/// - a primitive in one leaf lies exactly inside the leaf's box; a primitive in several leaves may have a part in each;
/// - every primitive is in a leaf. Primitives that builders drop (input.h) may be anywhere or nowhere.
/// The time is proportional to the sizes of the tree and the scene, for any depth. Primitives in several leaves are
/// also sorted.
/// @return the first error, with the numbers of the node, child and primitive: kInvalidInput, or kTooLarge if a number
/// needs more than 32 bits.
HIPRT_BUILD_API Result<void> validate(const ExchangeBvh& tree, const SceneInput& scene);

/// Builds a BVH from @p tree. Triangles of the same leaf are paired. Leaves with more than one pair are split by the
/// surface area heuristic. Nodes with more than two children become binary: the nearest two children are joined first.
/// Then follow reinsertion (BuildOptions::reinsertion_rounds), the optimal collapse to four children, and encoding.
///
/// Hits never depend on the tree: boxes are computed again from the primitives. A triangle in several leaves is split
/// between them by planes that separate their boxes. Without such a plane it stays whole in one leaf, as custom
/// primitives do. Subtrees deeper than about 60 levels are balanced.
/// @param options their builder and budgets are ignored.
/// @return the errors of validate() and build(). The statistics name Builder::kImported.
HIPRT_BUILD_API Result<Bvh> import_tree(const SceneInput& scene, const ExchangeBvh& tree,
                                        const BuildOptions& options = {});

/// @return the tree of a file: nodes with two to four children, and one leaf for each run of leaves. The boxes are
/// those of the file, which layouts half and quantized round outwards. The file's bounds replace infinite planes.
/// validate() accepts the tree together with the scene that the file was built from. Errors: kInvalidInput with the
/// message of hiprt::validate(), kTooLarge for 2^31 primitives or more, kOutOfMemory.
HIPRT_BUILD_API Result<ExchangeBvh> export_tree(const BufferView& file);

}  // namespace hiprt::build
