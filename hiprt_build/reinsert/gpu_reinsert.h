#pragma once
/// What becomes of a tree on the device before it is shown as a wide one. Internal.

#include <hiprt_build/encode/write_wide.h>
#include <hiprt_build/exec/gpu_long_step.h>
#include <hiprt_build/reinsert/reinsert_steps.h>

namespace hiprt::gpu {

struct TreeInput {
  /// References [capacity]; some may have no contents. Nodes [capacity]; unused nodes have no first child. The plans
  /// may be uninitialised and are written.
  build::PlannedTree tree;
  std::uint32_t capacity;
  const std::uint32_t* leaves;  ///< On the device: how many, if neither leaves nor nodes have gaps; else nullptr.
  unsigned rounds;              ///< Of reinsertion.
  /// On the device: references before splits, if usual_rounds() is to limit the rounds; else nullptr.
  const std::uint32_t* references = nullptr;
  std::uint32_t most_height = build::kMostReinsertionHeight;  ///< Tests choose others.
};

std::uint64_t finish_tree_scratch(std::uint32_t capacity, unsigned rounds);

/// Reinsertion, then the plans of all nodes, as steps of a stream. A tree that reinsertion has made too deep for a file
/// becomes again what it was.
/// @param asks between rounds.
Result<void> enqueue_finish_tree(const TreeInput& input, std::byte* scratch, hipStream_t stream, LongStep asks = {});

}  // namespace hiprt::gpu
