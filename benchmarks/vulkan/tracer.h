#pragma once
/// Traces rays through a scene of Vulkan.

#include "pipeline.h"
#include "scene.h"

#include <hiprt_device/ray.h>

#include <memory>

namespace hiprt::bench::vulkan {

/// A hit as Vulkan reports it.
struct VulkanHit {
  float t;                 ///< Infinity: a miss. For any hit: 0 at a hit.
  std::uint32_t instance;  ///< Its number among the scene's instances.
  std::uint32_t geometry;  ///< Mesh of the instance's object.
  std::uint32_t primitive;

  bool found() const { return primitive != kInvalidId; }
};

/// Buffers and pipelines for all scenes of a device.
class Tracer {
 public:
  static build::Result<Tracer> make(std::shared_ptr<Device> device);

  Device& device() const { return *device_; }
  /// Traces rays[i] and keeps the result in hits()[i]. @return seconds, without copies.
  build::Result<double> trace(const Scene& scene, bool any_hit, std::span<const Ray> rays);
  std::span<const VulkanHit> hits() const { return hits_; }

 private:
  build::Result<void> reserve(std::size_t rays);
  build::Result<double> trace_part(const Scene& scene, Pipeline& pipeline, std::span<const Ray> rays,
                                   std::span<VulkanHit> hits);

  std::shared_ptr<Device> device_;
  Pipeline closest_, any_;
  Buffer rays_, results_;            ///< Of the device.
  Buffer host_rays_, host_results_;  ///< Mapped.
  std::vector<VulkanHit> hits_;
};

}  // namespace hiprt::bench::vulkan
