#pragma once
/// A linked tree in depth-first order. Internal.

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/tree/binary_tree.h>

namespace hiprt::build {

/// The input of flatten().
struct LinkedTreeView {
  std::span<const Reference> leaves;  ///< By the numbers of leaves. Some may be unused.
  std::span<const LinkedNode> nodes;
  std::span<const std::uint32_t> counts;  ///< Leaves below each node.
  LinkedRef root;
};

/// Children stay left and right. Subtrees that would reach below kMaxDepth are halved by count instead, in the order of
/// their leaves.
DepthFirstTree flatten(CpuEngine& engine, const LinkedTreeView& linked);

}  // namespace hiprt::build
