#pragma once
/// HIPRT's build inputs as this library's. Internal.

#include <hiprt_build/gpu/batch.h>
#include <hiprt_build/gpu/import.h>

#include <hiprt/hiprt.h>

namespace hiprt::api {

enum class BuildKind { kFast = 0, kBalanced = 1, kHigh = 2, kImport = 3 };
inline BuildKind kind_of(const hiprtBuildOptions& options) { return static_cast<BuildKind>(options.buildFlags & 3u); }

/// Whether the counts are there: sizes and creation need no more.
bool has_counts(const hiprtGeometryBuildInput& input);
/// Whether counts and pointers are there that a build reads.
bool is_valid(const hiprtGeometryBuildInput& input, const hiprtBuildOptions& options);
/// Triangles or boxes.
std::uint32_t primitive_count(const hiprtGeometryBuildInput& input);
/// Pointers that are null become others: sizes do not depend on them.
gpu::DeviceGeometry geometry_of(const hiprtGeometryBuildInput& input);
gpu::DeviceTree tree_of(const hiprtGeometryBuildInput& input);
/// A tree of one primitive has no nodes: then the builder makes it.
bool imports(const hiprtGeometryBuildInput& input, const hiprtBuildOptions& options);
gpu::BuildOptions options_of(const hiprtBuildOptions& options);
/// The options of a batch, whatever the quality.
gpu::BuildOptions batch_options();

/// Whether a geometry is built together with others.
bool is_small(const hiprtGeometryBuildInput& input, const hiprtBuildOptions& options);

}  // namespace hiprt::api
