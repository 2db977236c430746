#pragma once
/// Top-down binned SAH builder. Internal.

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/steps/binary_tree.h>

namespace hiprt::build {

/// Builds a binary tree with one reference per leaf. The result does not depend on the number of threads.
/// @param references moved into the tree, which reorders them.
BinaryTree build_sah(CpuEngine& engine, ScratchArray<Reference> references);

}  // namespace hiprt::build
