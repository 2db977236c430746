#pragma once
/// Traces rays on all threads of the CPU.

#include <hiprt_device/scene_view.h>
#include <tools/base/parallel.h>
#include <tools/render/tracers/tracer.h>

#include <cstdint>
#include <functional>
#include <span>

namespace hiprt::bench {

/// Rays per task: enough to hide the scheduling, few enough to balance the threads.
inline constexpr std::size_t kRayBatch = 4096;

/// Calls @p trace(rays, hits) for all rays, a batch at a time. @return seconds.
double trace_batches(std::span<const Ray> rays, std::span<Hit> hits, const tools::ThreadLimit& limit,
                     const std::function<void(std::span<const Ray>, std::span<Hit>)>& trace);

/// Traces by tools::trace() with the default policies. @return seconds.
/// @param instances empty, or as many as rays for a scene of instances: the id of each hit's outermost instance,
/// kInvalidId for a miss.
double trace_on_host(const SceneView& scene, bool any_hit, std::span<const Ray> rays, std::span<Hit> hits,
                     const tools::ThreadLimit& limit, std::span<std::uint32_t> instances = {});

}  // namespace hiprt::bench
