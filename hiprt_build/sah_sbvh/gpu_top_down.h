#pragma once
/// Trees from the top on the device: references are split by binned SAH, and cut in space where that is cheaper (as
/// sbvh.cpp does it on the host). Internal.

#include <hiprt_build/gpu/error.h>
#include <hiprt_build/input/geometry.h>
#include <hiprt_build/tree/binary_tree.h>

#include <cstddef>
#include <cstdint>

namespace hiprt::gpu {

struct TopDownInput {
  build::GeometryTable geometries;     ///< On the device; its corners are read where there are cuts.
  const build::Reference* references;  ///< [input]; places where !contents.exists() hold nothing.
  std::uint32_t input;
  std::uint32_t capacity;  ///< Places of the output, at least input.
  double budget;  ///< At least 1: at most floor(budget * references) references may come of them, within the capacity.
  bool spatial_splits;  ///< False where there are custom primitives: references stay whole.
};

struct TopDownOutput {
  build::Reference* references;  ///< [capacity] Leaf i of the tree; unused ones have no group.
  build::LinkedNode* nodes;      ///< [capacity] By their numbers; unused ones have child[0] == kInvalidId.
  build::LinkedRef* root;        ///< On the device; kInvalidId if there is nothing.
  std::uint32_t* leaves;         ///< On the device: how many the tree has.
};

/// Sizes by which the work is parted. The tree depends on spare_levels and few, never on task.
struct TopDownTuning {
  std::uint32_t task = 2048;       ///< References that a block looks at together; more than 0.
  std::uint32_t wave_range = 512;  ///< A range of so many is one wave's, with all its subtree; at least 32.
  std::uint32_t spare_levels =
      12;  ///< Of larger ranges, beyond a balanced tree's; below that they are halved by count.

  /// A wave takes long for cuts: there it gets less.
  static TopDownTuning for_spatial_splits(bool cut) { return cut ? TopDownTuning{.wave_range = 64} : TopDownTuning{}; }
};

/// Bytes of scratch memory, to be aligned to kDeviceAlignment.
std::uint64_t top_down_scratch(std::uint32_t input, std::uint32_t capacity, const TopDownTuning& tuning);

/// Puts a row of launches into the stream; how many depends on the sizes alone. The input is not changed and may not
/// share memory with the output. Two runs give the same bytes.
Result<void> enqueue_top_down(const TopDownInput& input, const TopDownOutput& output, std::byte* scratch,
                              hipStream_t stream, const TopDownTuning& tuning);

}  // namespace hiprt::gpu
