#pragma once
/// Samples of a rectangle of pixels by paths, on the calling thread or on a GPU.

#include <tools/render/path/path_batch.h>
#include <tools/render/scene/path_scene.h>

#include <hiprt_build/error.h>

#include <functional>

namespace hiprt::tools {

class GpuPathTracer;

/// Adds the samples of @p part to the sums of its pixels. A wave holds one sample of all pixels, so that its memory
/// fits into a core's cache if the rectangle is small. It returns early when interrupted() becomes true.
/// @param alpha_cutout has_alpha_cutout() of the scene's data.
build::Result<void> trace_tile(const PathScene& scene, bool alpha_cutout, const PathBatch& part, const PathSums& sums,
                               PathRayCounts& rays);

/// The same on a GPU, for the sums that it has (GpuPathTracer::load()), in batches as large as it can take.
/// @param progress called with the finished fraction.
build::Result<void> trace_on_gpu(GpuPathTracer& gpu, const PathBatch& part, PathRayCounts& rays,
                                 const std::function<void(double)>& progress = {});

/// @return kInvalidInput if rays failed.
build::Result<void> check(const PathRayCounts& rays);

}  // namespace hiprt::tools
