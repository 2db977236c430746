#pragma once
/// A scene of Vulkan: bottom-level acceleration structures of objects, and a top-level one over their instances.

#include "structures.h"

#include <hiprt_build/input.h>
#include <hiprt_build/instances.h>

#include <vector>

namespace hiprt::bench::vulkan {

/// Seconds on the device.
struct SceneSeconds {
  double objects = 0, instances = 0;
};

class Scene {
 public:
  /// Copies the meshes to the device and allocates all memory.
  /// @param objects the meshes of each object. @param instances of objects; their ids are not used.
  static build::Result<Scene> make(Device& device, Preference preference,
                                   std::span<const std::vector<build::TriangleMesh>> objects,
                                   std::span<const build::Instance> instances);

  /// @pre compact() has not been called.
  build::Result<SceneSeconds> build();
  /// Compacts the structures and frees the meshes and the memory of builds. @return seconds of the copies.
  build::Result<SceneSeconds> compact();

  VkAccelerationStructureKHR top() const { return top_.handle(0); }
  /// Of all acceleration structures.
  std::uint64_t bytes() const { return bottom_.bytes() + top_.bytes(); }
  std::uint64_t built_bytes() const { return built_bytes_; }      ///< Before compact().
  std::uint64_t scratch_bytes() const { return scratch_bytes_; }  ///< The larger of both levels.

 private:
  build::Result<void> copy_meshes(std::span<const std::vector<build::TriangleMesh>> objects);
  std::vector<Structures::Input> bottom_inputs(std::span<const std::vector<build::TriangleMesh>> objects) const;
  build::Result<void> make_top(Preference preference);
  build::Result<void> write_instances();

  Device* device_ = nullptr;
  Buffer positions_, triangles_;
  std::vector<build::Instance> instances_;
  Buffer records_;  ///< The instances as the device reads them.
  Structures bottom_, top_;
  std::uint64_t built_bytes_ = 0, scratch_bytes_ = 0;
};

}  // namespace hiprt::bench::vulkan
