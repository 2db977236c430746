#pragma once
/// Memory of a Vulkan device.

#include "device.h"

#include <cstddef>
#include <span>

namespace hiprt::bench::vulkan {

/// A buffer and the memory that is bound to it. Destroy it before the device.
class Buffer {
 public:
  enum class Where {
    kDevice,   ///< Fast for the device.
    kUpload,   ///< Mapped, for bytes that the host writes.
    kReadBack  ///< Mapped, for bytes that the host reads.
  };

  Buffer() = default;
  static build::Result<Buffer> make(Device& device, std::uint64_t bytes, VkBufferUsageFlags usage, Where where);
  Buffer(Buffer&& other) noexcept { swap(other); }
  Buffer& operator=(Buffer&& other) noexcept {
    Buffer(std::move(other)).swap(*this);
    return *this;
  }
  ~Buffer();

  VkBuffer handle() const { return buffer_; }
  std::uint64_t size() const { return size_; }
  /// For buffers with VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT.
  VkDeviceAddress address() const { return address_; }
  /// The host's view of kUpload and kReadBack.
  std::byte* mapped() const { return mapped_; }

 private:
  void swap(Buffer& other) noexcept;
  build::Result<void> allocate(VkBufferUsageFlags usage, Where where);

  Device* device_ = nullptr;
  VkBuffer buffer_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  std::uint64_t size_ = 0;
  VkDeviceAddress address_ = 0;
  std::byte* mapped_ = nullptr;
};

/// A buffer in the device's memory with these bytes.
build::Result<Buffer> upload(Device& device, std::span<const std::byte> bytes, VkBufferUsageFlags usage);

}  // namespace hiprt::bench::vulkan
