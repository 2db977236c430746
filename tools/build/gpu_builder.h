#pragma once
/// Building on a GPU: meshes of the host in, a file in host memory out.

#include <hiprt_build/build.h>

#include <span>

namespace hiprt::tools {

/// As build::build(), on the current GPU. Of the options those that gpu::BuildOptions has count; the others are the
/// CPU's. The tree differs from the CPU's by its pairs, which are looked for among neighbours only.
/// @return kNoDevice if this build has no GPU code or there is no GPU that it has code for; the errors of
/// gpu::build_scene() otherwise. Statistics: tree_seconds is what the device takes from the first kernel to the last,
/// total_seconds holds allocations and copies too.
build::Result<build::Bvh> build_on_gpu(std::span<const build::TriangleMesh> meshes, const build::BuildOptions& options);

}  // namespace hiprt::tools
