#include "device.h"

#include "physical.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

namespace hiprt::bench::vulkan {
namespace {

/// Nanoseconds after which a device counts as lost. The longest work is the build of a large scene.
constexpr std::uint64_t kPatience = 300'000'000'000;

VKAPI_ATTR VkBool32 VKAPI_CALL keep_complaint(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                              const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  auto& complaint = *static_cast<std::string*>(user);
  if (complaint.empty()) complaint = data->pMessage;
  return VK_FALSE;
}

bool has_debug_utils(const Api& api) {
  std::uint32_t count = 0;
  api.EnumerateInstanceExtensionProperties(nullptr, &count, nullptr);
  std::vector<VkExtensionProperties> extensions(count);
  api.EnumerateInstanceExtensionProperties(nullptr, &count, extensions.data());
  return std::any_of(extensions.begin(), extensions.end(), [](const VkExtensionProperties& extension) {
    return std::string_view(extension.extensionName) == VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
  });
}

}  // namespace

build::Result<std::shared_ptr<Device>> Device::make(const Choice& choice) {
  auto api = Api::open();
  if (!api) return tl::unexpected(std::move(api.error()));
  std::shared_ptr<Device> device(new Device);
  device->api_ = *api;
  auto done = device->make_instance();
  if (done) done = device->choose(choice);
  if (done) done = device->make_device();
  if (done) done = device->make_queue();
  if (done) done = device->complaints();
  if (!done) return tl::unexpected(std::move(done.error()));
  return device;
}

Device::~Device() {
  if (device_ != VK_NULL_HANDLE) {
    api_.DeviceWaitIdle(device_);
    api_.DestroyQueryPool(device_, clock_, nullptr);
    api_.DestroyFence(device_, fence_, nullptr);
    api_.DestroyCommandPool(device_, pool_, nullptr);
    api_.DestroyDevice(device_, nullptr);
  }
  if (messenger_ != VK_NULL_HANDLE) api_.DestroyDebugUtilsMessengerEXT(instance_, messenger_, nullptr);
  if (instance_ != VK_NULL_HANDLE) api_.DestroyInstance(instance_, nullptr);
}

build::Result<void> Device::make_instance() {
  const bool debug = has_debug_utils(api_);
  const std::array<const char*, 1> extensions{VK_EXT_DEBUG_UTILS_EXTENSION_NAME};
  auto application = structure<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
  application.apiVersion = VK_API_VERSION_1_2;
  auto info = structure<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
  info.pApplicationInfo = &application;
  info.enabledExtensionCount = debug ? 1 : 0;
  info.ppEnabledExtensionNames = extensions.data();
  const VkResult result = api_.CreateInstance(&info, nullptr, &instance_);
  // Without any driver this is the loader's result.
  if (result == VK_ERROR_INCOMPATIBLE_DRIVER)
    return tl::unexpected(build::Error{build::ErrorCode::kNoDevice, "no Vulkan driver (VK_ERROR_INCOMPATIBLE_DRIVER)"});
  if (auto done = check(result, "vkCreateInstance"); !done) return done;
  api_.load_instance(instance_);
  if (!debug) return {};
  auto messenger =
      structure<VkDebugUtilsMessengerCreateInfoEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT);
  messenger.messageSeverity =
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  messenger.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
  messenger.pfnUserCallback = keep_complaint;
  messenger.pUserData = &complaint_;
  return check(api_.CreateDebugUtilsMessengerEXT(instance_, &messenger, nullptr, &messenger_),
               "vkCreateDebugUtilsMessengerEXT");
}

build::Result<void> Device::choose(const Choice& choice) {
  auto candidate = choose_device(api_, instance_, choice);
  if (!candidate) return tl::unexpected(std::move(candidate.error()));
  physical_ = candidate->device;
  family_ = *candidate->family;
  facts_.name = candidate->name;
  const bool wants_query =
      choice.calls == "query" || (choice.calls == "auto" && candidate->type == VK_PHYSICAL_DEVICE_TYPE_CPU);
  const bool query = wants_query ? candidate->query : !candidate->pipeline;
  facts_.calls = query ? RayCalls::kQuery : RayCalls::kPipeline;
  api_.GetPhysicalDeviceMemoryProperties(physical_, &memory_);
  read_facts();
  return {};
}

void Device::read_facts() {
  auto structures = structure<VkPhysicalDeviceAccelerationStructurePropertiesKHR>(
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_PROPERTIES_KHR);
  auto pipelines = structure<VkPhysicalDeviceRayTracingPipelinePropertiesKHR>(
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_PROPERTIES_KHR);
  auto driver = structure<VkPhysicalDeviceDriverProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES);
  auto all = structure<VkPhysicalDeviceProperties2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2);
  all.pNext = &structures;
  structures.pNext = &driver;
  if (facts_.calls == RayCalls::kPipeline) driver.pNext = &pipelines;
  api_.GetPhysicalDeviceProperties2(physical_, &all);
  facts_.driver = std::string(driver.driverName) + " " + driver.driverInfo;
  facts_.buffer_range = all.properties.limits.maxStorageBufferRange;
  facts_.tick = 1e-9 * static_cast<double>(all.properties.limits.timestampPeriod);
  facts_.handle_size = pipelines.shaderGroupHandleSize;
  facts_.base_alignment = std::max(1u, pipelines.shaderGroupBaseAlignment);
  facts_.scratch_alignment = std::max(1u, structures.minAccelerationStructureScratchOffsetAlignment);
  facts_.most_primitives = structures.maxPrimitiveCount;
  facts_.most_instances = structures.maxInstanceCount;
}

build::Result<void> Device::make_device() {
  const bool query = facts_.calls == RayCalls::kQuery;
  const std::array<const char*, 3> extensions{
      VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME, VK_KHR_DEFERRED_HOST_OPERATIONS_EXTENSION_NAME,
      query ? VK_KHR_RAY_QUERY_EXTENSION_NAME : VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME};
  Features features(!query, query);
  features.structures.accelerationStructure = features.addresses.bufferDeviceAddress = VK_TRUE;
  features.pipelines.rayTracingPipeline = features.queries.rayQuery = VK_TRUE;
  const float priority = 1.0f;
  auto queue = structure<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
  queue.queueFamilyIndex = family_;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  auto info = structure<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO);
  info.pNext = &features.structures;
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  info.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
  info.ppEnabledExtensionNames = extensions.data();
  if (auto done = check(api_.CreateDevice(physical_, &info, nullptr, &device_), "vkCreateDevice"); !done) return done;
  api_.load_device(device_);
  return {};
}

build::Result<void> Device::make_queue() {
  api_.GetDeviceQueue(device_, family_, 0, &queue_);
  auto pool = structure<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
  pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
  pool.queueFamilyIndex = family_;
  if (auto done = check(api_.CreateCommandPool(device_, &pool, nullptr, &pool_), "vkCreateCommandPool"); !done)
    return done;
  auto buffer = structure<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
  buffer.commandPool = pool_;
  buffer.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  buffer.commandBufferCount = 1;
  if (auto done = check(api_.AllocateCommandBuffers(device_, &buffer, &commands_), "vkAllocateCommandBuffers"); !done)
    return done;
  const auto fence = structure<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
  if (auto done = check(api_.CreateFence(device_, &fence, nullptr, &fence_), "vkCreateFence"); !done) return done;
  auto clock = structure<VkQueryPoolCreateInfo>(VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO);
  clock.queryType = VK_QUERY_TYPE_TIMESTAMP;
  clock.queryCount = 2;
  return check(api_.CreateQueryPool(device_, &clock, nullptr, &clock_), "vkCreateQueryPool");
}

build::Result<double> Device::run(const std::function<void(VkCommandBuffer)>& record) {
  auto begin = structure<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  auto done = check(api_.BeginCommandBuffer(commands_, &begin), "vkBeginCommandBuffer");
  if (!done) return tl::unexpected(std::move(done.error()));
  api_.CmdResetQueryPool(commands_, clock_, 0, 2);
  api_.CmdWriteTimestamp(commands_, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, clock_, 0);
  record(commands_);
  api_.CmdWriteTimestamp(commands_, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, clock_, 1);
  done = check(api_.EndCommandBuffer(commands_), "vkEndCommandBuffer");
  auto submit = structure<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
  submit.commandBufferCount = 1;
  submit.pCommandBuffers = &commands_;
  if (done) done = check(api_.ResetFences(device_, 1, &fence_), "vkResetFences");
  if (done) done = check(api_.QueueSubmit(queue_, 1, &submit, fence_), "vkQueueSubmit");
  if (done) done = check(api_.WaitForFences(device_, 1, &fence_, VK_TRUE, kPatience), "vkWaitForFences");
  std::array<std::uint64_t, 2> ticks{};
  if (done)
    done = check(api_.GetQueryPoolResults(device_, clock_, 0, 2, sizeof(ticks), ticks.data(), sizeof(ticks[0]),
                                          VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
                 "vkGetQueryPoolResults");
  if (done) done = complaints();
  if (!done) return tl::unexpected(std::move(done.error()));
  return facts_.tick * static_cast<double>(ticks[1] - ticks[0]);
}

void Device::barrier(VkCommandBuffer commands) const {
  auto memory = structure<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
  memory.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
  memory.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
  api_.CmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 1,
                          &memory, 0, nullptr, 0, nullptr);
}

build::Result<void> Device::complaints() {
  if (complaint_.empty()) return {};
  return tl::unexpected(
      build::Error{build::ErrorCode::kGpu, "Vulkan's validation layer: " + std::exchange(complaint_, {})});
}

}  // namespace hiprt::bench::vulkan
