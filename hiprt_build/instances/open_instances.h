#pragma once
/// Opens instances: several leaves of an opened instance lead rays to parts of its object (Benthin et al. 2017,
/// "Improved two-level BVHs using partial re-braiding"). Internal.

#include <hiprt_build/instances/part_boxes.h>

namespace hiprt::build {

/// Replaces parts by the children of their nodes where that makes rays faster, the largest boxes first.
///
/// The model: rays meet a box in proportion to its area, and entering a part costs the same everywhere. So opening
/// gains where the areas of the children sum to less than that of the part.
/// @param budget most parts per instance, on average.
/// @param largest opens without asking whether it gains.
void open_instances(CpuEngine& engine, PartBoxes& boxes, double budget, bool largest);

}  // namespace hiprt::build
