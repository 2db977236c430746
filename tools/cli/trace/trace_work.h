#pragma once
/// A batch of rays, and how bvhtrace traces it.

#include <tools/base/parallel.h>
#include <tools/render/tracers/gpu_tracer.h>

#include <functional>
#include <optional>
#include <span>

namespace hiprt::tools {

struct TraceWork {
  const SceneView& scene;
  Query query;
  TracePolicies policies;
  std::span<const Ray> rays;
  std::span<Hit> hits;
  std::span<std::uint32_t> paths;  ///< scene.levels per ray.
};

/// Traces the batch, on the GPU if there is one.
/// @param progress called with the finished fraction.
/// @return seconds, of a GPU those of its kernels; kCancelled; the errors of GpuTracer::trace().
build::Result<double> trace_batch(const TraceWork& work, std::optional<GpuTracer>& gpu, const ThreadLimit& limit,
                                  const std::function<void(double)>& progress);

}  // namespace hiprt::tools
