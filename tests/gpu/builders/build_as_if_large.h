#pragma once
/// Builds whose nodes and leaves are written in the order in which files of many nodes are written. With
/// BuildOptions::progress they ask between all rounds and levels whether to go on.

#include <hiprt_build/gpu/build.h>

namespace hiprt::checks {

/// As gpu::enqueue_build() with valid arguments, which takes as much memory.
gpu::Result<const gpu::BuildReport*> enqueue_as_if_large(std::span<const gpu::DeviceGeometry> geometries,
                                                         const gpu::BuildOptions& options, std::byte* output,
                                                         std::byte* scratch);

}  // namespace hiprt::checks
