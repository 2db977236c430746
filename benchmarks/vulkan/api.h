#pragma once
/// The functions of Vulkan that the benchmarks call. The loader is opened at run time, so programs start without it.

#include <hiprt_build/error.h>

#define VK_NO_PROTOTYPES
#include <vulkan/vulkan.h>

namespace hiprt::bench::vulkan {

#define HIPRT_VULKAN_GLOBAL_FUNCTIONS(F) F(CreateInstance) F(EnumerateInstanceExtensionProperties)

#define HIPRT_VULKAN_INSTANCE_FUNCTIONS(F)  \
  F(DestroyInstance)                        \
  F(EnumeratePhysicalDevices)               \
  F(EnumerateDeviceExtensionProperties)     \
  F(GetPhysicalDeviceProperties)            \
  F(GetPhysicalDeviceProperties2)           \
  F(GetPhysicalDeviceFeatures2)             \
  F(GetPhysicalDeviceMemoryProperties)      \
  F(GetPhysicalDeviceQueueFamilyProperties) \
  F(CreateDevice)                           \
  F(GetDeviceProcAddr)

/// Of the extension VK_EXT_debug_utils.
#define HIPRT_VULKAN_DEBUG_FUNCTIONS(F) F(CreateDebugUtilsMessengerEXT) F(DestroyDebugUtilsMessengerEXT)

#define HIPRT_VULKAN_DEVICE_FUNCTIONS(F)      \
  F(DestroyDevice)                            \
  F(DeviceWaitIdle)                           \
  F(GetDeviceQueue)                           \
  F(AllocateMemory)                           \
  F(FreeMemory)                               \
  F(MapMemory)                                \
  F(CreateBuffer)                             \
  F(DestroyBuffer)                            \
  F(GetBufferMemoryRequirements)              \
  F(BindBufferMemory)                         \
  F(GetBufferDeviceAddress)                   \
  F(CreateCommandPool)                        \
  F(DestroyCommandPool)                       \
  F(AllocateCommandBuffers)                   \
  F(ResetCommandBuffer)                       \
  F(BeginCommandBuffer)                       \
  F(EndCommandBuffer)                         \
  F(CreateFence)                              \
  F(DestroyFence)                             \
  F(ResetFences)                              \
  F(WaitForFences)                            \
  F(QueueSubmit)                              \
  F(CreateQueryPool)                          \
  F(DestroyQueryPool)                         \
  F(GetQueryPoolResults)                      \
  F(CmdResetQueryPool)                        \
  F(CmdWriteTimestamp)                        \
  F(CmdPipelineBarrier)                       \
  F(CmdCopyBuffer)                            \
  F(CreateShaderModule)                       \
  F(DestroyShaderModule)                      \
  F(CreateDescriptorSetLayout)                \
  F(DestroyDescriptorSetLayout)               \
  F(CreateDescriptorPool)                     \
  F(DestroyDescriptorPool)                    \
  F(AllocateDescriptorSets)                   \
  F(UpdateDescriptorSets)                     \
  F(CreatePipelineLayout)                     \
  F(DestroyPipelineLayout)                    \
  F(CreateComputePipelines)                   \
  F(DestroyPipeline)                          \
  F(CmdBindPipeline)                          \
  F(CmdBindDescriptorSets)                    \
  F(CmdPushConstants)                         \
  F(CmdDispatch)                              \
  F(CreateAccelerationStructureKHR)           \
  F(DestroyAccelerationStructureKHR)          \
  F(GetAccelerationStructureBuildSizesKHR)    \
  F(GetAccelerationStructureDeviceAddressKHR) \
  F(CmdBuildAccelerationStructuresKHR)        \
  F(CmdCopyAccelerationStructureKHR)          \
  F(CmdWriteAccelerationStructuresPropertiesKHR)

/// Of the extension VK_KHR_ray_tracing_pipeline.
#define HIPRT_VULKAN_PIPELINE_FUNCTIONS(F) \
  F(CreateRayTracingPipelinesKHR) F(GetRayTracingShaderGroupHandlesKHR) F(CmdTraceRaysKHR)

/// The members have the functions' names without "vk".
struct Api {
  PFN_vkGetInstanceProcAddr GetInstanceProcAddr = nullptr;
#define HIPRT_VULKAN_MEMBER(name) PFN_vk##name name = nullptr;
  HIPRT_VULKAN_GLOBAL_FUNCTIONS(HIPRT_VULKAN_MEMBER)
  HIPRT_VULKAN_INSTANCE_FUNCTIONS(HIPRT_VULKAN_MEMBER)
  HIPRT_VULKAN_DEBUG_FUNCTIONS(HIPRT_VULKAN_MEMBER)
  HIPRT_VULKAN_DEVICE_FUNCTIONS(HIPRT_VULKAN_MEMBER)
  HIPRT_VULKAN_PIPELINE_FUNCTIONS(HIPRT_VULKAN_MEMBER)
#undef HIPRT_VULKAN_MEMBER

  /// Opens libvulkan.so.1, which stays open: drivers do not expect to be unloaded.
  /// @return kNoDevice with the dynamic linker's reason.
  static build::Result<Api> open();
  void load_instance(VkInstance instance);
  void load_device(VkDevice device);
};

/// "VK_ERROR_DEVICE_LOST"; a number for values that this header does not know.
std::string result_name(VkResult result);

/// An error unless @p result is VK_SUCCESS: kOutOfMemory or kGpu, with the function's and the result's name.
build::Result<void> check(VkResult result, const char* function);

}  // namespace hiprt::bench::vulkan
