#pragma once
/// References that are split before a tree is built over them. Internal.

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/tree/binary_tree.h>

namespace hiprt::build {

/// Splits references of triangles at planes of a grid over the scene, coarse planes first: those are where a tree will
/// part the scene. Who has the most empty area in its box, and the coarsest planes through it, is split most often.
/// @param budget references that there may be afterwards, relative to those before, at least 1.
/// @pre no group is of custom primitives.
/// @return at most budget times as many references; their order follows that of the input.
ScratchArray<Reference> presplit(CpuEngine& engine, const GeometryTable& geometries, ScratchArray<Reference> references,
                                 double budget);

}  // namespace hiprt::build
