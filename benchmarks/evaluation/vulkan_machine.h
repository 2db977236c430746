#pragma once
/// Vulkan's ray tracing as a competitor. Programs that were built without Vulkan's headers have no device.

#include "competitor.h"

#include <nlohmann/json.hpp>

#include <memory>
#include <string>
#include <vector>

namespace hiprt::bench {

/// "fast_build" and "fast_trace": the preferences of builds (VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_*).
std::vector<std::string> vulkan_modes();

/// How shaders trace rays: "pipeline" or "query".
std::vector<std::string> vulkan_calls();

struct VulkanOptions {
  std::vector<std::string> modes;  ///< Of vulkan_modes().
  std::string device;              ///< A part of the device's name. Empty: the first GPU.
  std::string calls = "pipeline";  ///< Of vulkan_calls(). A device that has only the other one takes that.
  bool software = false;           ///< Whether drivers that run on the CPU will do.
};

/// A device of Vulkan, for all competitors.
class VulkanMachine {
 public:
  VulkanMachine() = default;
  VulkanMachine(const VulkanMachine&) = delete;
  VulkanMachine& operator=(const VulkanMachine&) = delete;
  virtual ~VulkanMachine() = default;

  /// Its name, driver and calls, for the JSON.
  virtual nlohmann::json describe() const = 0;
  /// @param mode of vulkan_modes().
  virtual std::unique_ptr<Competitor> compete(const std::string& mode, const Hierarchy& hierarchy) = 0;
};

/// @return kNoDevice with the reason.
build::Result<std::shared_ptr<VulkanMachine>> open_vulkan(const VulkanOptions& options);

}  // namespace hiprt::bench
