#pragma once
/// Traces rays through a scene of Vulkan.

#include "pipeline.h"
#include "scene.h"

#include <memory>

namespace hiprt::bench::vulkan {

/// Buffers and pipelines for all scenes of a device.
class Tracer {
 public:
  static build::Result<Tracer> make(std::shared_ptr<Device> device);

  Device& device() const { return *device_; }
  /// Traces rays[i] @p times and keeps the last result in hits()[i]. @return seconds of each time, without copies.
  build::Result<std::vector<double>> trace(const Scene& scene, bool any_hit, std::span<const Ray> rays, unsigned times);
  std::span<const VulkanHit> hits() const { return hits_; }

 private:
  build::Result<void> reserve(std::size_t rays);
  build::Result<void> trace_part(const Scene& scene, Pipeline& pipeline, std::span<const Ray> rays,
                                 std::span<VulkanHit> hits, std::span<double> seconds);

  std::shared_ptr<Device> device_;
  Pipeline closest_, any_;
  Buffer rays_, results_;            ///< Of the device.
  Buffer host_rays_, host_results_;  ///< Mapped.
  std::vector<VulkanHit> hits_;
};

}  // namespace hiprt::bench::vulkan
