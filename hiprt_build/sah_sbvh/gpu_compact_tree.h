#pragma once
/// Closes the gaps that a top-down builder leaves between leaves and between nodes. Internal.

#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/gpu/error.h>
#include <hiprt_build/tree/binary_tree.h>

namespace hiprt::gpu {

/// A tree whose numbers have gaps. What is unused has no contents or child[0] == kInvalidId.
struct GappedTree {
  build::Reference* leaves = nullptr;  ///< [slots]
  build::LinkedNode* nodes = nullptr;  ///< [slots]

  static GappedTree take(Arena& arena, std::uint32_t slots) {
    return {arena.take<build::Reference>(slots), arena.take<build::LinkedNode>(slots)};
  }
};

/// The same tree without gaps. Leaves and nodes keep their order.
struct CompactTree {
  build::Reference* leaves;
  build::LinkedNode* nodes;
  std::uint32_t capacity;  ///< At least the number of leaves. What is behind them is marked as unused.
  build::LinkedRef* root;  ///< On the device; its number is changed.
};

/// Bytes of scratch memory, to be aligned to kDeviceAlignment.
std::uint64_t compact_tree_scratch(std::uint32_t slots);

Result<void> enqueue_compact_tree(const GappedTree& from, std::uint32_t slots, const CompactTree& to,
                                  std::byte* scratch, hipStream_t stream);

}  // namespace hiprt::gpu
