#pragma once
/// Pre-splitting on the device. Internal.

#include <hiprt_build/gpu/error.h>
#include <hiprt_build/pipeline/gpu_state.h>

namespace hiprt::gpu {

struct PresplitInput {
  build::GeometryTable geometries;
  const build::Reference* references;  ///< [input]; entries without contents are skipped.
  std::uint32_t input;
  std::uint32_t capacity;  ///< split_capacity(input, budget)
  double budget;
  build::kernels::BuildState* state;  ///< Its number of leaves becomes the number of parts.
};

/// @pre no custom primitives.
std::uint64_t presplit_scratch(std::uint32_t input, std::uint32_t capacity);

/// Enqueues the steps that split references as presplit() does on the host.
/// @param parts [capacity]; unused entries get no contents.
Result<void> enqueue_presplit(const PresplitInput& input, build::Reference* parts, std::byte* scratch,
                              hipStream_t stream);

/// Measures what split_budget_for() needs. @pre no custom primitives. @param references [count]; entries without
/// contents are skipped. @param state gets the demand; its bounds are known.
Result<void> enqueue_measure_demand(const build::GeometryTable& geometries, const build::Reference* references,
                                    std::uint32_t count, build::kernels::BuildState* state, hipStream_t stream);

}  // namespace hiprt::gpu
