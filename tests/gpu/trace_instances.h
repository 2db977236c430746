#pragma once
/// Rays on the device through a scene whose view only the device knows.

#include <hiprt_build/gpu/instances.h>
#include <hiprt_device/ray.h>

#include <span>
#include <vector>

namespace hiprt::checks {

struct InstanceAnswer {
  float t = 0, u = 0;
  std::uint32_t instance[2] = {kInvalidId, kInvalidId};
  std::uint32_t primitive = kInvalidId;

  friend bool operator==(const InstanceAnswer&, const InstanceAnswer&) = default;
};

/// By the default policies for two levels of instances, of layout kPlanes; as host() with the file's view.
gpu::Result<std::vector<InstanceAnswer>> trace_instances(const gpu::InstanceReport* report, std::span<const Ray> rays,
                                                         hipStream_t stream, gpu::Allocator& allocator);
std::vector<InstanceAnswer> trace_instances(const SceneView& view, std::span<const Ray> rays);

}  // namespace hiprt::checks
