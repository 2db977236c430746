#pragma once
/// The small geometries of a call, which are built together. Internal.

#include <hiprt_build/hiprt_api/context.h>
#include <hiprt_build/hiprt_api/geometry_input.h>

#include <memory>
#include <vector>

namespace hiprt::api {

/// The inputs of a call that are built together, by number.
std::vector<std::uint32_t> small_inputs(GeometryInputs inputs, const hiprtBuildOptions& options);

Result<gpu::BuildSizes> batch_sizes(GeometryInputs inputs, std::span<const std::uint32_t> numbers);

/// What a call builds.
struct BuildWork {
  bool all_valid = true;                     ///< Counts and pointers are there.
  std::shared_ptr<Pool> pool;                ///< Whose batch is among the geometries, whole and in order; or nullptr.
  std::unique_ptr<HostBuffer> descriptions;  ///< Of the batch: DeviceGeometry.
  bool has_other_counts = false;             ///< In the batch, than when it was created.
  std::vector<std::uint32_t> others;         ///< The geometries that are built one by one.
};

/// Checks the inputs and converts those of the batch, in one pass.
Result<BuildWork> gather(hiprtContextObject& context, GeometryInputs inputs, const hiprtBuildOptions& options,
                         const hiprtGeometry* geometries);

/// @param work with a pool. Its descriptions go back to the context.
Result<void> build_batch(hiprtContextObject& context, BuildWork& work, Scratch& temporary, hipStream_t stream);

}  // namespace hiprt::api
