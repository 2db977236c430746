#pragma once
/// Top-down binned SAH builder. Internal.

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/tree/binary_tree.h>

#include <span>

namespace hiprt::build {

/// Builds a binary tree with one reference per leaf. The result does not depend on the number of threads.
/// @param references moved into the tree, which reorders them.
DepthFirstTree build_sah(CpuEngine& engine, ScratchArray<Reference> references);

/// The same over a part of a larger tree's references. Callable from any thread. @pre there is a reference.
/// @param spare as large as references, or empty for fewer than kParallelSize (sah_reduce.h).
/// @param nodes for 2 * references.size() - 1; they count references from the part's first.
void build_sah(CpuEngine& engine, std::span<Reference> references, std::span<Reference> spare,
               std::span<DepthFirstNode> nodes);

}  // namespace hiprt::build
