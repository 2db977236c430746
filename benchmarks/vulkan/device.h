#pragma once
/// A Vulkan device with ray tracing, and its only queue.

#include "api.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace hiprt::bench::vulkan {

/// How shaders trace rays.
enum class RayCalls {
  kPipeline,  ///< VK_KHR_ray_tracing_pipeline: traceRayEXT() with closest-hit and miss shaders.
  kQuery,     ///< VK_KHR_ray_query: rayQueryEXT in a compute shader.
};

/// Which device, and how it traces.
struct Choice {
  std::string device;  ///< A part of its name. Empty: the first GPU.
  /// "pipeline" or "query". A device that has only the other one takes that. "auto": pipelines, on a CPU queries,
  /// because our pipeline crashes on lavapipe 25.0.
  std::string calls = "auto";
  bool software = false;  ///< Whether a driver that runs on the CPU (lavapipe) will do.
};

struct Facts {
  std::string name;    ///< Of the device.
  std::string driver;  ///< Name and version of the driver, for example "NVIDIA 580.95.05".
  RayCalls calls = RayCalls::kPipeline;
  std::uint64_t buffer_range = 0;       ///< Most bytes of a storage buffer in a shader.
  std::uint32_t handle_size = 0;        ///< Bytes of a shader group's handle.
  std::uint32_t base_alignment = 1;     ///< Of shader groups in the binding table.
  std::uint32_t scratch_alignment = 1;  ///< Of the scratch memory of builds.
  std::uint64_t most_primitives = 0;    ///< Of a bottom-level acceleration structure.
  std::uint64_t most_instances = 0;
  double tick = 0;  ///< Seconds of one step of a timestamp.
};

class Device {
 public:
  /// @return kNoDevice with the reason: no loader, no driver, or what each device lacks.
  static build::Result<std::shared_ptr<Device>> make(const Choice& choice);
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  ~Device();

  const Api& api() const { return api_; }
  VkDevice handle() const { return device_; }
  const Facts& facts() const { return facts_; }
  const VkPhysicalDeviceMemoryProperties& memory() const { return memory_; }

  /// Runs commands and waits for them. @return their seconds, from the device's timestamps.
  build::Result<double> run(const std::function<void(VkCommandBuffer)>& record);
  /// Lets later commands of the same command buffer see what the earlier ones wrote.
  void barrier(VkCommandBuffer commands) const;
  /// @return an error if the validation layer has reported one since the last call.
  build::Result<void> complaints();

 private:
  Device() = default;
  build::Result<void> make_instance();
  build::Result<void> choose(const Choice& choice);
  void read_facts();
  build::Result<void> make_device();
  build::Result<void> make_queue();

  Api api_;
  VkInstance instance_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  std::string complaint_;  ///< The first one.
  VkPhysicalDevice physical_ = VK_NULL_HANDLE;
  std::uint32_t family_ = 0;  ///< Of the queue.
  Facts facts_;
  VkPhysicalDeviceMemoryProperties memory_{};
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;
  VkFence fence_ = VK_NULL_HANDLE;
  VkQueryPool clock_ = VK_NULL_HANDLE;
};

}  // namespace hiprt::bench::vulkan
