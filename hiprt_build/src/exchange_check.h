#pragma once
/// What the import needs to know of a tree of unknown origin. Internal.

#include <hiprt_build/error.h>
#include <hiprt_build/exchange.h>
#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/steps/geometry.h>

namespace hiprt::build {

struct CheckedTree {
  ScratchArray<std::uint32_t> order;  ///< All nodes, parents before their children.
  /// Per primitive: the leaf that it is built in, kInvalidId for dropped ones. Of several leaves the one whose box it
  /// enlarges least, then the lower node.
  ScratchArray<std::uint32_t> home;
};

/// @pre check_sizes() and check_indices() accepted the scene.
/// @return the errors of validate(const ExchangeBvh&, const SceneInput&).
Result<CheckedTree> check_tree(CpuEngine& engine, const ExchangeBvh& tree, const PrimitiveSoup& soup);

}  // namespace hiprt::build
