#pragma once
/// Vulkan's ray tracing as a competitor. Programs that were built without Vulkan's headers have no device.

#include "competitor.h"

#include <benchmarks/common/flags.h>

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
  std::vector<std::string> modes{"default"};  ///< Of vulkan_modes(). "default": all on a GPU, none on a CPU.
  std::string device;                         ///< A part of the device's name. Empty: the first GPU.
  std::string calls = "pipeline";             ///< Of vulkan_calls(). A device that has only the other one takes that.
  bool software = false;                      ///< Whether drivers that run on the CPU will do.

  /// --vulkan, --vulkan-device and --vulkan-calls.
  std::vector<Flag> flags();
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

/// Opens the device for a program that runs on a GPU or on a CPU. There, drivers that run on the CPU will do.
/// @param options whose default modes are replaced. Without modes nothing is opened.
/// @return nullptr without modes, or an error as open_vulkan().
build::Result<std::shared_ptr<VulkanMachine>> open_chosen(VulkanOptions& options, bool gpu);

}  // namespace hiprt::bench
