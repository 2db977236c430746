#pragma once
/// Closest and any hits of a scene in layout kPlanes on the host and on a GPU: default policies and Reference.

#include <hiprt_build/gpu/gpu.h>
#include <hiprt_device/ray.h>
#include <hiprt_device/scene_view.h>

#include <span>
#include <vector>

namespace hiprt::checks {

struct ExtremeHits {
  Hit closest, reference;
  std::uint32_t any = 0;  ///< Whether there is any hit, by the default policies.
};

std::vector<ExtremeHits> trace_extremes(const SceneView& scene, std::span<const Ray> rays);
/// @param scene on the device.
gpu::Result<std::vector<ExtremeHits>> trace_extremes_on_device(const SceneView& scene, std::span<const Ray> rays);

}  // namespace hiprt::checks
