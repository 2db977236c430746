#pragma once
/// Measures the quality of the tree in a file, with one cost function for every builder.

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>

#include <array>
#include <cstdint>

namespace hiprt::build {

struct TreeStatistics {
  std::uint64_t nodes = 0;
  std::uint64_t leaves = 0;
  std::uint64_t custom_leaves = 0;   ///< Leaves of custom primitives.
  std::uint64_t leaf_triangles = 0;  ///< Triangles in leaves; more than the primitives where references were split.
  std::uint64_t leaf_customs = 0;    ///< Custom primitives in leaves.
  std::uint64_t leaf_runs = 0;       ///< Child references to leaves.
  std::array<std::uint64_t, 5> nodes_by_children{};  ///< [k]: nodes with k children.
  std::uint32_t depth = 0;                           ///< Box nodes on the longest path from the root to a leaf.
  double fill = 0;                                   ///< Mean number of children of a node / 4.
  double pair_fill = 0;                              ///< Primitives per leaf / 2.
  double sah_cost = 0;  ///< Expected cost of a random ray that hits the root box (MacDonald & Booth 1990): see below.
  double sibling_overlap = 0;  ///< Area-weighted mean of sibling intersection area / parent area.
  double exchange_slack = 0;   ///< 0 to 1: the part of the area that small changes would save; see below.
};

///     SAH cost = (sum over nodes of area * costs.box_node + sum over leaves of area * costs.leaf) / root area
///
/// An area is half the surface of the box that the parent stores; a leaf has the area of its child box. Leaves of
/// custom primitives have costs.custom. In layout half the header's bounds replace infinite planes. If the root is a
/// leaf, the SAH cost is the cost of its leaves.
///
/// Exchange slack: how much area exchanges of nodes would save, as a part of the sum of the box nodes' areas without
/// the root. For each box node, one of its children may be exchanged for one of its siblings; the best exchange counts.
/// This is the gain of tree rotations (Kensler, "Tree rotations for improving bounding volume hierarchies", 2008). It
/// does not depend on how large or spread the scene is. Builders that minimize area leave 0.00 to 0.08, lbvh up to 0.2.
/// @pre @p view is of a validated file.
HIPRT_BUILD_API TreeStatistics measure_tree(const BufferView& view, const SahCosts& costs = {});

}  // namespace hiprt::build
