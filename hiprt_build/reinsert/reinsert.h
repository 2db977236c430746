#pragma once
/// Improves a tree by reinsertion. Internal.

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/tree/binary_tree.h>

namespace hiprt::build {

/// Moves subtrees to better positions (see reinsert_rounds.h). The result does not depend on
/// the number of threads.
DepthFirstTree reinsert(CpuEngine& engine, DepthFirstTree tree, unsigned rounds);

}  // namespace hiprt::build
