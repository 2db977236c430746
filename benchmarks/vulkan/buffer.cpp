#include "buffer.h"

#include "physical.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

namespace hiprt::bench::vulkan {
namespace {

/// The first type of memory that has all wanted properties, else the first that has the needed ones.
std::optional<std::uint32_t> memory_type(const VkPhysicalDeviceMemoryProperties& memory, std::uint32_t allowed,
                                         VkMemoryPropertyFlags needed, VkMemoryPropertyFlags wanted) {
  for (const VkMemoryPropertyFlags flags : {needed | wanted, needed})
    for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i)
      if ((allowed >> i & 1u) != 0 && (memory.memoryTypes[i].propertyFlags & flags) == flags) return i;
  return std::nullopt;
}

}  // namespace

build::Result<Buffer> Buffer::make(Device& device, std::uint64_t bytes, VkBufferUsageFlags usage, Where where) {
  Buffer result;
  result.device_ = &device;
  // Vulkan has no empty buffers.
  result.size_ = std::max<std::uint64_t>(bytes, 4);
  auto info = structure<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
  info.size = result.size_;
  info.usage = usage;
  if (auto done = check(device.api().CreateBuffer(device.handle(), &info, nullptr, &result.buffer_), "vkCreateBuffer");
      !done)
    return tl::unexpected(std::move(done.error()));
  if (auto done = result.allocate(usage, where); !done) return tl::unexpected(std::move(done.error()));
  return result;
}

build::Result<void> Buffer::allocate(VkBufferUsageFlags usage, Where where) {
  const Api& api = device_->api();
  VkMemoryRequirements requirements{};
  api.GetBufferMemoryRequirements(device_->handle(), buffer_, &requirements);
  constexpr VkMemoryPropertyFlags kMapped = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  const auto type =
      where == Where::kDevice
          ? memory_type(device_->memory(), requirements.memoryTypeBits, 0, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT)
          : memory_type(device_->memory(), requirements.memoryTypeBits, kMapped,
                        where == Where::kReadBack ? VK_MEMORY_PROPERTY_HOST_CACHED_BIT : 0);
  if (!type) return tl::unexpected(build::Error{build::ErrorCode::kGpu, "Vulkan: no type of memory for a buffer"});
  const bool addressed = (usage & VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT) != 0;
  auto flags = structure<VkMemoryAllocateFlagsInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO);
  flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
  auto info = structure<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
  info.pNext = addressed ? &flags : nullptr;
  info.allocationSize = requirements.size;
  info.memoryTypeIndex = *type;
  auto done = check(api.AllocateMemory(device_->handle(), &info, nullptr, &memory_), "vkAllocateMemory");
  if (done) done = check(api.BindBufferMemory(device_->handle(), buffer_, memory_, 0), "vkBindBufferMemory");
  if (done && where != Where::kDevice) {
    void* mapped = nullptr;
    done = check(api.MapMemory(device_->handle(), memory_, 0, VK_WHOLE_SIZE, 0, &mapped), "vkMapMemory");
    mapped_ = static_cast<std::byte*>(mapped);
  }
  if (done && addressed) {
    auto wanted = structure<VkBufferDeviceAddressInfo>(VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO);
    wanted.buffer = buffer_;
    address_ = api.GetBufferDeviceAddress(device_->handle(), &wanted);
  }
  return done;
}

Buffer::~Buffer() {
  if (device_ == nullptr) return;
  device_->api().DestroyBuffer(device_->handle(), buffer_, nullptr);
  device_->api().FreeMemory(device_->handle(), memory_, nullptr);
}

void Buffer::swap(Buffer& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(buffer_, other.buffer_);
  std::swap(memory_, other.memory_);
  std::swap(size_, other.size_);
  std::swap(address_, other.address_);
  std::swap(mapped_, other.mapped_);
}

build::Result<Buffer> upload(Device& device, std::span<const std::byte> bytes, VkBufferUsageFlags usage) {
  auto result = Buffer::make(device, bytes.size(), usage | VK_BUFFER_USAGE_TRANSFER_DST_BIT, Buffer::Where::kDevice);
  if (!result || bytes.empty()) return result;
  const auto staging = Buffer::make(device, bytes.size(), VK_BUFFER_USAGE_TRANSFER_SRC_BIT, Buffer::Where::kUpload);
  if (!staging) return tl::unexpected(staging.error());
  std::memcpy(staging->mapped(), bytes.data(), bytes.size());
  const auto copied = device.run([&](VkCommandBuffer commands) {
    const VkBufferCopy all{0, 0, bytes.size()};
    device.api().CmdCopyBuffer(commands, staging->handle(), result->handle(), 1, &all);
  });
  if (!copied) return tl::unexpected(copied.error());
  return result;
}

}  // namespace hiprt::bench::vulkan
