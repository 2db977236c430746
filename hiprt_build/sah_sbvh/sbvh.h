#pragma once
/// Top-down SAH builder with spatial splits. Internal.

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/input/builder_defaults.h>
#include <hiprt_build/tree/binary_tree.h>

namespace hiprt::build {

/// Builds a binary tree in which a leaf's primitives may have several references. The result does not depend on the
/// number of threads.
/// @pre triangles only, unless split_budget is 1.
/// @param split_budget as BuildOptions::split_budget.
DepthFirstTree build_sbvh(CpuEngine& engine, const GeometryTable& geometries, ScratchArray<Reference> references,
                          double split_budget, const SplitRules& rules);

}  // namespace hiprt::build
