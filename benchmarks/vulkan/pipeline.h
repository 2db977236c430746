#pragma once
/// The shaders as a pipeline of Vulkan: one for each kind of query.

#include "buffer.h"

#include <array>

namespace hiprt::bench::vulkan {

/// Traces the rays of a buffer. The device must outlive it.
class Pipeline {
 public:
  Pipeline() = default;
  static build::Result<Pipeline> make(Device& device, bool any_hit);
  Pipeline(Pipeline&& other) noexcept { swap(other); }
  Pipeline& operator=(Pipeline&& other) noexcept {
    Pipeline(std::move(other)).swap(*this);
    return *this;
  }
  ~Pipeline();

  /// Selects what dispatch() reads and writes.
  void bind(VkAccelerationStructureKHR scene, const Buffer& rays, const Buffer& results);
  void dispatch(VkCommandBuffer commands, std::uint32_t rays) const;

 private:
  void swap(Pipeline& other) noexcept;
  build::Result<void> make_layout();
  build::Result<void> make_set();
  build::Result<VkShaderModule> module(std::span<const std::uint32_t> code);
  build::Result<void> make_query_pipeline(bool any_hit);
  build::Result<void> make_ray_pipeline(bool any_hit);
  build::Result<void> make_table();

  Device* device_ = nullptr;
  VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
  VkDescriptorSet set_ = VK_NULL_HANDLE;
  VkPipeline pipeline_ = VK_NULL_HANDLE;
  std::vector<VkShaderModule> modules_;
  Buffer table_;  ///< The binding table: ray generation, miss and hit group.
  std::array<VkStridedDeviceAddressRegionKHR, 3> regions_{};
};

}  // namespace hiprt::bench::vulkan
