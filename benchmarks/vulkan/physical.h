#pragma once
/// What a physical device of Vulkan can do.

#include "device.h"

#include <optional>

namespace hiprt::bench::vulkan {

/// A structure of Vulkan, with its type and zeros.
template <class T> T structure(VkStructureType type) {
  T result{};
  result.sType = type;
  return result;
}

/// The features that ray tracing needs, as a chain that starts at `structures`: vkGetPhysicalDeviceFeatures2 fills it,
/// vkCreateDevice switches on what it holds.
struct Features {
  /// @param pipeline, query: whether the chain holds them.
  Features(bool pipeline, bool query);
  Features(const Features&) = delete;
  Features& operator=(const Features&) = delete;

  VkPhysicalDeviceAccelerationStructureFeaturesKHR structures;
  VkPhysicalDeviceBufferDeviceAddressFeatures addresses;
  VkPhysicalDeviceRayTracingPipelineFeaturesKHR pipelines;
  VkPhysicalDeviceRayQueryFeaturesKHR queries;
};

/// A device and what it lacks to trace rays.
struct Candidate {
  VkPhysicalDevice device = VK_NULL_HANDLE;
  VkPhysicalDeviceType type = VK_PHYSICAL_DEVICE_TYPE_OTHER;
  std::string name;
  bool pipeline = false, query = false;
  std::optional<std::uint32_t> family;  ///< Of a queue that computes and has timestamps.
  std::string lacks;                    ///< What it needs in addition; empty: it can trace.

  int rank() const;  ///< Smaller is better: discrete GPUs, other GPUs, software.
};

Candidate examine(const Api& api, VkPhysicalDevice device);

/// @return the best device of the choice, or kNoDevice with the reason for each device.
build::Result<Candidate> choose_device(const Api& api, VkInstance instance, const Choice& choice);

}  // namespace hiprt::bench::vulkan
