#pragma once
/// Top-down builders on the device: binned SAH, with spatial splits where they are cheaper, as sbvh.cpp on the host.
/// Internal.

#include <hiprt_build/exec/gpu_long_step.h>
#include <hiprt_build/input/builder_defaults.h>
#include <hiprt_build/input/geometry.h>
#include <hiprt_build/tree/binary_tree.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace hiprt::gpu {

struct TopDownInput {
  build::GeometryTable geometries;     ///< On the device. Spatial splits read its corners.
  const build::Reference* references;  ///< [input]; entries without contents are skipped.
  std::uint32_t input;
  std::uint32_t capacity;  ///< Entries of the output, at least input.
  double budget;        ///< At least 1. Splits make at most floor(budget * references) references, within the capacity.
  bool spatial_splits;  ///< False for custom primitives, which stay whole.
  build::SplitRules splits;
};

struct TopDownOutput {
  build::Reference* references;  ///< [capacity] Leaf i of the tree; unused ones have no contents.
  build::LinkedNode* nodes;      ///< [capacity] By their numbers; unused ones have child[0] == kInvalidId.
  build::LinkedRef* root;        ///< On the device; kInvalidId for an empty tree.
  std::uint32_t* leaves;         ///< On the device: the number of leaves.
};

/// Sizes of the work of blocks and waves. The tree depends on spare_levels and wave_range, not on task.
struct TopDownTuning {
  /// References that a block processes together; more than 0, at most 2^20. One block splits a range of up to so many.
  std::uint32_t task = 2048;
  std::uint32_t wave_range = 512;  ///< One wave builds the subtree of a range of up to so many references; at least 32.
  /// How many levels deeper than in a balanced tree a larger range may lie, at most 32. Deeper ones are halved by
  /// count.
  std::uint32_t spare_levels = 8;

  /// For so many primitives. A GPU of 132 multiprocessors needs several hundred blocks; larger tasks add their bins to
  /// those of the range more rarely. A wave takes long for spatial splits: its ranges are smaller.
  static TopDownTuning of(std::uint32_t primitives, bool spatial) {
    const std::uint32_t task = std::clamp<std::uint32_t>(std::bit_floor(primitives / 1200), 256, 2048);
    return {.task = task, .wave_range = spatial ? 64u : 512u};
  }
};

/// Bytes of scratch memory, to be aligned to kDeviceAlignment.
std::uint64_t top_down_scratch(std::uint32_t input, std::uint32_t capacity, const TopDownTuning& tuning,
                               const build::SplitRules& splits);

/// Enqueues the launches of a build. Their number depends on the sizes only. The input is not changed and must not
/// overlap the output. Two runs give the same bytes.
/// @param asks between levels, and between slices of the ranges below them.
Result<void> enqueue_top_down(const TopDownInput& input, const TopDownOutput& output, std::byte* scratch,
                              hipStream_t stream, const TopDownTuning& tuning, LongStep asks = {});

}  // namespace hiprt::gpu
