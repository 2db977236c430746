#include "physical.h"

#include <algorithm>
#include <string_view>
#include <vector>

namespace hiprt::bench::vulkan {
namespace {

bool has(const std::vector<VkExtensionProperties>& extensions, std::string_view name) {
  return std::any_of(extensions.begin(), extensions.end(),
                     [&](const VkExtensionProperties& extension) { return extension.extensionName == name; });
}

std::vector<VkExtensionProperties> extensions_of(const Api& api, VkPhysicalDevice device) {
  std::uint32_t count = 0;
  api.EnumerateDeviceExtensionProperties(device, nullptr, &count, nullptr);
  std::vector<VkExtensionProperties> extensions(count);
  api.EnumerateDeviceExtensionProperties(device, nullptr, &count, extensions.data());
  extensions.resize(count);
  return extensions;
}

std::optional<std::uint32_t> compute_family(const Api& api, VkPhysicalDevice device) {
  std::uint32_t count = 0;
  api.GetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  api.GetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  for (std::uint32_t i = 0; i < count; ++i)
    if ((families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) != 0 && families[i].timestampValidBits != 0) return i;
  return std::nullopt;
}

}  // namespace

Features::Features(bool pipeline, bool query)
    : structures(structure<VkPhysicalDeviceAccelerationStructureFeaturesKHR>(
          VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_FEATURES_KHR)),
      addresses(structure<VkPhysicalDeviceBufferDeviceAddressFeatures>(
          VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES)),
      pipelines(structure<VkPhysicalDeviceRayTracingPipelineFeaturesKHR>(
          VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_FEATURES_KHR)),
      queries(
          structure<VkPhysicalDeviceRayQueryFeaturesKHR>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_QUERY_FEATURES_KHR)) {
  structures.pNext = &addresses;
  void** end = &addresses.pNext;
  if (pipeline) *end = &pipelines, end = &pipelines.pNext;
  if (query) *end = &queries;
}

int Candidate::rank() const {
  if (type == VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU) return 0;
  return type == VK_PHYSICAL_DEVICE_TYPE_CPU ? 2 : 1;
}

Candidate examine(const Api& api, VkPhysicalDevice device) {
  VkPhysicalDeviceProperties properties{};
  api.GetPhysicalDeviceProperties(device, &properties);
  Candidate result;
  result.device = device;
  result.type = properties.deviceType;
  result.name = properties.deviceName;
  if (properties.apiVersion < VK_API_VERSION_1_2) {
    result.lacks = "Vulkan 1.2";
    return result;
  }
  const auto extensions = extensions_of(api, device);
  for (const char* name :
       {VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME, VK_KHR_DEFERRED_HOST_OPERATIONS_EXTENSION_NAME})
    if (!has(extensions, name)) {
      result.lacks = name;
      return result;
    }
  Features features(has(extensions, VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME),
                    has(extensions, VK_KHR_RAY_QUERY_EXTENSION_NAME));
  auto all = structure<VkPhysicalDeviceFeatures2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2);
  all.pNext = &features.structures;
  api.GetPhysicalDeviceFeatures2(device, &all);
  result.pipeline = features.pipelines.rayTracingPipeline == VK_TRUE;
  result.query = features.queries.rayQuery == VK_TRUE;
  result.family = compute_family(api, device);
  if (features.structures.accelerationStructure != VK_TRUE || features.addresses.bufferDeviceAddress != VK_TRUE)
    result.lacks = "acceleration structures or buffer addresses";
  else if (!result.pipeline && !result.query)
    result.lacks = "ray tracing pipelines and ray queries";
  else if (!result.family)
    result.lacks = "a compute queue with timestamps";
  return result;
}

build::Result<Candidate> choose_device(const Api& api, VkInstance instance, const Choice& choice) {
  std::uint32_t count = 0;
  if (auto done = check(api.EnumeratePhysicalDevices(instance, &count, nullptr), "vkEnumeratePhysicalDevices"); !done)
    return tl::unexpected(std::move(done.error()));
  std::vector<VkPhysicalDevice> devices(count);
  api.EnumeratePhysicalDevices(instance, &count, devices.data());
  devices.resize(count);
  std::optional<Candidate> best;
  std::string why;
  for (VkPhysicalDevice device : devices) {
    Candidate candidate = examine(api, device);
    if (candidate.lacks.empty() && !choice.software && candidate.type == VK_PHYSICAL_DEVICE_TYPE_CPU)
      candidate.lacks = "a GPU";
    if (candidate.name.find(choice.device) == std::string::npos)
      candidate.lacks = "'" + choice.device + "' in its name";
    if (!candidate.lacks.empty())
      why += (why.empty() ? "" : "; ") + candidate.name + " lacks " + candidate.lacks;
    else if (!best || candidate.rank() < best->rank())
      best = std::move(candidate);
  }
  if (best) return *best;
  return tl::unexpected(build::Error{build::ErrorCode::kNoDevice,
                                     "no Vulkan device can trace rays: " + (why.empty() ? "there is none" : why)});
}

}  // namespace hiprt::bench::vulkan
