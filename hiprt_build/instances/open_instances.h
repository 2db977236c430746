#pragma once
/// Opens instances: several leaves of an opened instance lead rays to parts of its object (Benthin et al. 2017,
/// "Improved two-level BVHs using partial re-braiding"). Internal.

#include <hiprt_build/instances/part_boxes.h>

#include <cstddef>
#include <span>
#include <vector>

namespace hiprt::build {

/// How much each box and the others of a tree lie in each other. The sum of the shares of its volume that lie inside
/// the siblings of all nodes above its leaf, and of the shares of other boxes that lie inside it where it is such a
/// sibling. 0: nothing else is there.
/// @param tree over boxes, one per leaf.
/// @param count of the boxes, by the number of the custom primitive.
std::vector<float> measure_overlap(const BufferView& tree, std::size_t count);

/// Replaces parts by the children of their nodes where that makes rays faster, most gain first, until there are
/// @p budget times as many parts as instances.
///
/// The model: rays meet a box in proportion to its area, and entering a part costs the same everywhere. So opening
/// gains where the areas of the children sum to less than that of the part. Where other boxes cover it, they may sum to
/// more: its children take their places among the others in the order of distance, and those behind a hit are not
/// entered.
/// @param overlap of each instance; see measure_overlap().
void open_instances(CpuEngine& engine, PartBoxes& boxes, double budget, std::span<const float> overlap);

}  // namespace hiprt::build
