#pragma once
/// What a physical device of Vulkan can do.

#include "device.h"

#include <optional>

namespace hiprt::bench::vulkan {

/// A device that can trace rays.
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

/// A structure of Vulkan, with its type and zeros.
template <class T> T structure(VkStructureType type) {
  T result{};
  result.sType = type;
  return result;
}

}  // namespace hiprt::bench::vulkan
