#pragma once
/// References of triangles that are split on the device before there is a tree. Internal.

#include <hiprt_build/gpu/error.h>
#include <hiprt_build/pipeline/gpu_state.h>

namespace hiprt::gpu {

struct PresplitInput {
  build::GeometryTable geometries;
  const build::Reference* references;  ///< [input]; some may be none.
  std::uint32_t input;
  std::uint32_t capacity;  ///< split_capacity(input, budget)
  double budget;
  build::kernels::BuildState* state;  ///< Its number of leaves becomes that of the parts.
};

/// @pre no custom primitives.
std::uint64_t presplit_scratch(std::uint32_t input, std::uint32_t capacity);

/// Splits references as presplit() does on the host, as steps of a stream.
/// @param parts [capacity]; some become none.
Result<void> enqueue_presplit(const PresplitInput& input, build::Reference* parts, std::byte* scratch,
                              hipStream_t stream);

}  // namespace hiprt::gpu
