#pragma once
/// A scene of Vulkan: bottom-level acceleration structures of objects, and a top-level one over their instances.

#include "machine.h"
#include "structures.h"

#include <vector>

namespace hiprt::bench::vulkan {

class Scene {
 public:
  /// Copies the meshes to the device and allocates all memory.
  static build::Result<Scene> make(Device& device, const VulkanInput& input);

  /// @pre compact() has not been called.
  build::Result<VulkanSeconds> build();
  /// Compacts the structures and frees the meshes and the memory of builds. @return seconds of the copies.
  build::Result<VulkanSeconds> compact();

  VkAccelerationStructureKHR top() const { return top_.handle(0); }
  VulkanBytes bytes() const { return {bottom_.bytes() + top_.bytes(), built_bytes_, scratch_bytes_}; }

 private:
  build::Result<void> copy_meshes(std::span<const std::vector<build::TriangleMesh>> objects);
  std::vector<Structures::Input> bottom_inputs(std::span<const std::vector<build::TriangleMesh>> objects) const;
  build::Result<void> make_top(BuildFlags flags);
  build::Result<void> write_instances();

  Device* device_ = nullptr;
  Buffer positions_, triangles_;
  std::vector<build::Instance> instances_;
  Buffer records_;  ///< The instances as the device reads them.
  Structures bottom_, top_;
  std::uint64_t built_bytes_ = 0, scratch_bytes_ = 0;
};

}  // namespace hiprt::bench::vulkan
