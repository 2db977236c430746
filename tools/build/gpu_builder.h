#pragma once
/// Builds on a GPU: reads meshes and instances of the host and returns a file in host memory.

#include <hiprt_build/build.h>
#include <hiprt_build/instances.h>

#include <span>

namespace hiprt::tools {

/// As build::build(), on the current GPU. Options that gpu::BuildOptions lacks are ignored. The GPU pairs triangles
/// with neighbours only, so its tree differs from the CPU's.
/// @return kNoDevice if this build has no GPU code, or none for the GPUs of the machine; else the errors of
/// gpu::build_scene(). In the statistics tree_seconds is the time from the first kernel to the last; total_seconds also
/// includes allocations and copies.
build::Result<build::Bvh> build_on_gpu(std::span<const build::TriangleMesh> meshes, const build::BuildOptions& options);

/// As build::build_instances() with one group, on the current GPU. No instance has a motion, and no object has shapes.
/// @return kNoDevice as build_on_gpu(); else the errors of gpu::enqueue_instances() and of read_report().
build::Result<build::Bvh> join_on_gpu(std::span<const std::span<const std::byte>> objects,
                                      std::span<const build::Instance> instances,
                                      const build::InstanceOptions& options);

}  // namespace hiprt::tools
