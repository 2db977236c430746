#pragma once
/// Builders that sort references along a Morton curve and join them from the leaves to the root. Internal.

#include <hiprt_build/build.h>
#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/tree/binary_tree.h>

namespace hiprt::build {

/// Builds a binary tree with one reference per leaf. The result does not depend on the number of threads.
/// @param builder kLbvh, kLbvh30, kPloc or kHploc.
/// @param ploc_radius as BuildOptions::ploc_radius.
DepthFirstTree build_bottom_up(CpuEngine& engine, Builder builder, ScratchArray<Reference> references,
                               unsigned ploc_radius);

}  // namespace hiprt::build
