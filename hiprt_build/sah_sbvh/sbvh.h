#pragma once
/// Top-down SAH builder with spatial splits. Internal.

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/input/geometry.h>
#include <hiprt_build/tree/binary_tree.h>

namespace hiprt::build {

/// Builds a binary tree in which a group may have several references. The result does not depend on the number of
/// threads.
/// @param groups of triangles only, unless split_budget is 1.
/// @param split_budget as BuildOptions::split_budget.
BinaryTree build_sbvh(CpuEngine& engine, const PrimitiveSoup& soup, std::span<const PrimitiveGroup> groups,
                      ScratchArray<Reference> references, double split_budget);

}  // namespace hiprt::build
