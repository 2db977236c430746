#pragma once
/// Closest hits below still and moving instances on the host and on a GPU: default policies, Reference, and rays in
/// double.

#include <hiprt_build/gpu/gpu.h>
#include <hiprt_device/ray.h>
#include <hiprt_device/scene_view.h>

#include <span>
#include <vector>

namespace hiprt::checks {

constexpr unsigned kExtremeLevels = 16;

/// No padding: compared as bytes.
struct ExtremeInstanceHit {
  double t = 0, u = 0, v = 0;
  double normal[3] = {};
  double t_error = 0;
  double spawned[3] = {};  ///< spawn_origin() of a ray back; 0 for a miss.
  float error = 0;
  std::uint32_t geometry = 0, primitive = 0, depth = 0;
  std::uint32_t instance[kExtremeLevels] = {};
};
static_assert(sizeof(ExtremeInstanceHit) == 10 * 8 + 4 * 4 + kExtremeLevels * 4);

struct ExtremeInstanceHits {
  ExtremeInstanceHit closest, reference, in_double;
};

std::vector<ExtremeInstanceHits> trace_extreme_instances(const SceneView& scene, std::span<const Ray> rays);
/// @param scene on the device.
gpu::Result<std::vector<ExtremeInstanceHits>> trace_extreme_instances_on_device(const SceneView& scene,
                                                                                std::span<const Ray> rays);

}  // namespace hiprt::checks
