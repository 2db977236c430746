#pragma once
/// Builds on a GPU: reads meshes of the host and returns a file in host memory.

#include <hiprt_build/build.h>

#include <span>

namespace hiprt::tools {

/// As build::build(), on the current GPU. Options that gpu::BuildOptions lacks are ignored. The GPU pairs triangles
/// with neighbours only, so its tree differs from the CPU's.
/// @return kNoDevice if this build has no GPU code, or none for the GPUs of the machine; else the errors of
/// gpu::build_scene(). In the statistics tree_seconds is the time from the first kernel to the last; total_seconds also
/// includes allocations and copies.
build::Result<build::Bvh> build_on_gpu(std::span<const build::TriangleMesh> meshes, const build::BuildOptions& options);

}  // namespace hiprt::tools
