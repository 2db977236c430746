#include "api.h"

#include <dlfcn.h>

#include <array>
#include <utility>

namespace hiprt::bench::vulkan {
namespace {

#define HIPRT_VULKAN_RESULT(name) \
  std::pair { name, #name }
constexpr std::array kResults{HIPRT_VULKAN_RESULT(VK_SUCCESS),
                              HIPRT_VULKAN_RESULT(VK_NOT_READY),
                              HIPRT_VULKAN_RESULT(VK_TIMEOUT),
                              HIPRT_VULKAN_RESULT(VK_EVENT_SET),
                              HIPRT_VULKAN_RESULT(VK_EVENT_RESET),
                              HIPRT_VULKAN_RESULT(VK_INCOMPLETE),
                              HIPRT_VULKAN_RESULT(VK_ERROR_OUT_OF_HOST_MEMORY),
                              HIPRT_VULKAN_RESULT(VK_ERROR_OUT_OF_DEVICE_MEMORY),
                              HIPRT_VULKAN_RESULT(VK_ERROR_INITIALIZATION_FAILED),
                              HIPRT_VULKAN_RESULT(VK_ERROR_DEVICE_LOST),
                              HIPRT_VULKAN_RESULT(VK_ERROR_MEMORY_MAP_FAILED),
                              HIPRT_VULKAN_RESULT(VK_ERROR_LAYER_NOT_PRESENT),
                              HIPRT_VULKAN_RESULT(VK_ERROR_EXTENSION_NOT_PRESENT),
                              HIPRT_VULKAN_RESULT(VK_ERROR_FEATURE_NOT_PRESENT),
                              HIPRT_VULKAN_RESULT(VK_ERROR_INCOMPATIBLE_DRIVER),
                              HIPRT_VULKAN_RESULT(VK_ERROR_TOO_MANY_OBJECTS),
                              HIPRT_VULKAN_RESULT(VK_ERROR_FORMAT_NOT_SUPPORTED),
                              HIPRT_VULKAN_RESULT(VK_ERROR_FRAGMENTED_POOL),
                              HIPRT_VULKAN_RESULT(VK_ERROR_UNKNOWN),
                              HIPRT_VULKAN_RESULT(VK_ERROR_OUT_OF_POOL_MEMORY),
                              HIPRT_VULKAN_RESULT(VK_ERROR_INVALID_EXTERNAL_HANDLE),
                              HIPRT_VULKAN_RESULT(VK_ERROR_FRAGMENTATION),
                              HIPRT_VULKAN_RESULT(VK_ERROR_INVALID_OPAQUE_CAPTURE_ADDRESS),
                              HIPRT_VULKAN_RESULT(VK_PIPELINE_COMPILE_REQUIRED),
                              HIPRT_VULKAN_RESULT(VK_ERROR_SURFACE_LOST_KHR),
                              HIPRT_VULKAN_RESULT(VK_ERROR_NATIVE_WINDOW_IN_USE_KHR),
                              HIPRT_VULKAN_RESULT(VK_SUBOPTIMAL_KHR),
                              HIPRT_VULKAN_RESULT(VK_ERROR_OUT_OF_DATE_KHR),
                              HIPRT_VULKAN_RESULT(VK_ERROR_INCOMPATIBLE_DISPLAY_KHR),
                              HIPRT_VULKAN_RESULT(VK_ERROR_VALIDATION_FAILED_EXT),
                              HIPRT_VULKAN_RESULT(VK_ERROR_INVALID_SHADER_NV),
                              HIPRT_VULKAN_RESULT(VK_ERROR_NOT_PERMITTED_KHR),
                              HIPRT_VULKAN_RESULT(VK_THREAD_IDLE_KHR),
                              HIPRT_VULKAN_RESULT(VK_THREAD_DONE_KHR),
                              HIPRT_VULKAN_RESULT(VK_OPERATION_DEFERRED_KHR),
                              HIPRT_VULKAN_RESULT(VK_OPERATION_NOT_DEFERRED_KHR)};
#undef HIPRT_VULKAN_RESULT

}  // namespace

build::Result<Api> Api::open() {
  void* library = dlopen("libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr)
    return tl::unexpected(build::Error{build::ErrorCode::kNoDevice, std::string("no Vulkan loader: ") + dlerror()});
  Api api;
  api.GetInstanceProcAddr = reinterpret_cast<PFN_vkGetInstanceProcAddr>(dlsym(library, "vkGetInstanceProcAddr"));
  if (api.GetInstanceProcAddr == nullptr)
    return tl::unexpected(
        build::Error{build::ErrorCode::kNoDevice, "libvulkan.so.1 has no function vkGetInstanceProcAddr"});
#define HIPRT_VULKAN_LOAD(name) \
  api.name = reinterpret_cast<PFN_vk##name>(api.GetInstanceProcAddr(VK_NULL_HANDLE, "vk" #name));
  HIPRT_VULKAN_GLOBAL_FUNCTIONS(HIPRT_VULKAN_LOAD)
#undef HIPRT_VULKAN_LOAD
  return api;
}

void Api::load_instance(VkInstance instance) {
#define HIPRT_VULKAN_LOAD(name) name = reinterpret_cast<PFN_vk##name>(GetInstanceProcAddr(instance, "vk" #name));
  HIPRT_VULKAN_INSTANCE_FUNCTIONS(HIPRT_VULKAN_LOAD)
  HIPRT_VULKAN_DEBUG_FUNCTIONS(HIPRT_VULKAN_LOAD)
#undef HIPRT_VULKAN_LOAD
}

void Api::load_device(VkDevice device) {
#define HIPRT_VULKAN_LOAD(name) name = reinterpret_cast<PFN_vk##name>(GetDeviceProcAddr(device, "vk" #name));
  HIPRT_VULKAN_DEVICE_FUNCTIONS(HIPRT_VULKAN_LOAD)
  HIPRT_VULKAN_PIPELINE_FUNCTIONS(HIPRT_VULKAN_LOAD)
#undef HIPRT_VULKAN_LOAD
}

std::string result_name(VkResult result) {
  for (const auto& [value, name] : kResults)
    if (value == result) return name;
  return "VkResult " + std::to_string(static_cast<int>(result));
}

build::Result<void> check(VkResult result, const char* function) {
  if (result == VK_SUCCESS) return {};
  const bool memory = result == VK_ERROR_OUT_OF_HOST_MEMORY || result == VK_ERROR_OUT_OF_DEVICE_MEMORY;
  return tl::unexpected(build::Error{memory ? build::ErrorCode::kOutOfMemory : build::ErrorCode::kGpu,
                                     std::string("Vulkan, ") + function + ": " + result_name(result)});
}

}  // namespace hiprt::bench::vulkan
