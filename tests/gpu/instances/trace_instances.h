#pragma once
/// Traces rays on the device through a scene whose view is in device memory only.

#include <hiprt_build/gpu/instances.h>
#include <hiprt_device/ray.h>

#include <span>
#include <vector>

namespace hiprt::checks {

struct InstanceHit {
  float t = 0, u = 0;
  std::uint32_t instance[2] = {kInvalidId, kInvalidId};
  std::uint32_t primitive = kInvalidId;

  friend bool operator==(const InstanceHit&, const InstanceHit&) = default;
};

/// The memory of a ray's stack and instance paths (PathMemory).
enum class MemoryOfStacks {
  kThread,
  kShared,  ///< A rolling stack's ring, and the instance paths.
};

/// Default policies with another stack, two levels of instances, layout kPlanes.
gpu::Result<std::vector<InstanceHit>> trace_instances(const gpu::InstanceReport* report, std::span<const Ray> rays,
                                                      MemoryOfStacks memory, hipStream_t stream,
                                                      gpu::Allocator& allocator);
/// On the host.
std::vector<InstanceHit> trace_instances(const SceneView& view, std::span<const Ray> rays);

}  // namespace hiprt::checks
