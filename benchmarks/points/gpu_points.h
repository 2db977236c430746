#pragma once
/// Point queries on a GPU, for bench_points.

#include "kernel.h"

#include <hiprt_build/error.h>

#include <span>
#include <string>
#include <vector>

namespace hiprt::bench {

struct GpuPointRun {
  std::vector<double> seconds;  ///< Of the kernel, by events: one per round.
  std::vector<double> results;  ///< As PointJob::results.
};

/// @return its name and architecture. kNoDevice or kGpu: there is none, or the program has no GPU code.
build::Result<std::string> gpu_name();

/// @param file whole BVH file. @param variant PointVariant.
build::Result<GpuPointRun> ask_gpu(std::span<const std::byte> file, std::span<const Vec3> points, unsigned variant,
                                   float reach, unsigned rounds);

}  // namespace hiprt::bench
