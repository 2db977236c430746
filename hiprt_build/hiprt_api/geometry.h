#pragma once
/// Creation and builds of geometries. Internal.

#include <hiprt_build/hiprt_api/context.h>
#include <hiprt_build/hiprt_api/geometry_input.h>

namespace hiprt::api {

/// Bytes of a geometry that is built alone. Scratch is enough for updates too.
Result<gpu::BuildSizes> geometry_sizes(const hiprtGeometryBuildInput& input, const hiprtBuildOptions& options);
Result<std::uint64_t> temporary_size(GeometryInputs inputs, const hiprtBuildOptions& options);
/// @param outs addresses of the handles.
Result<void> create_geometries(hiprtContext context, GeometryInputs inputs, const hiprtBuildOptions& options,
                               hiprtGeometry* const* outs);
/// @return false if counts or pointers are missing: then nothing is built.
Result<bool> build_geometries(hiprtContext context, hiprtBuildOperation operation, GeometryInputs inputs,
                              const hiprtBuildOptions& options, void* temporary, hipStream_t stream,
                              const hiprtGeometry* geometries);

/// New boxes for moved vertices. Waits for the stream.
/// @return false: the tree cannot have them and must be built.
Result<bool> refit_geometry(const Found& found, const gpu::DeviceGeometry& moved, std::byte* scratch,
                            hipStream_t stream);

}  // namespace hiprt::api
