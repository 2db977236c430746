#pragma once
/// Trees of Embree's rtcBuildBVH. Internal.

#include <hiprt_build/build.h>
#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/tree/binary_tree.h>

namespace hiprt::build {

/// @param builder one of Builder::kEmbree*. kEmbreeHigh may make several references of one (spatial splits).
/// @param split_budget as BuildOptions::split_budget.
/// @return kBackend with Embree's error, also if the tree would be deeper than kMaxDepth.
Result<DepthFirstTree> build_embree(CpuEngine& engine, Builder builder, const GeometryTable& geometries,
                                    ScratchArray<Reference> references, double split_budget);

}  // namespace hiprt::build
