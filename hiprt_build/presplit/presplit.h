#pragma once
/// Pre-splitting: splits references before a tree is built over them. Internal.

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/presplit/split_demand.h>
#include <hiprt_build/tree/binary_tree.h>

namespace hiprt::build {

/// Splits references of triangles at planes of a grid over the scene, coarse planes first, because the tree is likely
/// to split the scene there. References with much empty area in their box and coarse planes through it get most splits.
/// @param budget references that there may be afterwards, relative to those before, at least 1.
/// @pre no custom primitives.
/// @return at most budget times as many references; their order follows that of the input.
ScratchArray<Reference> presplit(CpuEngine& engine, const GeometryTable& geometries, ScratchArray<Reference> references,
                                 double budget);

/// @return what split_budget_for() needs. @param leaves of all triangles. @pre no custom primitives.
SplitDemand measure_demand(CpuEngine& engine, const GeometryTable& geometries, std::span<const LeafPrimitives> leaves);

}  // namespace hiprt::build
