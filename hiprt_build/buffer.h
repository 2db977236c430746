#pragma once
/// Owner of the bytes of a BVH file.

#include <hiprt_build/export.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

namespace hiprt::build {

/// A move-only block of bytes aligned for every use of a BVH file (kBufferAlignment; a mapped file: a page).
class HIPRT_BUILD_API Buffer {
 public:
  using Release = std::function<void(std::byte* data, std::size_t size)>;

  Buffer() = default;
  /// @param size bytes, filled with zeros. Throws std::bad_alloc when there is no memory.
  explicit Buffer(std::size_t size);
  /// @param size bytes, not initialised. Throws std::bad_alloc when there is no memory.
  static Buffer uninitialized(std::size_t size);
  /// Takes ownership of memory (a mapping, a caller's allocation); @p release frees it.
  Buffer(std::byte* data, std::size_t size, Release release);
  Buffer(Buffer&& other) noexcept;
  Buffer& operator=(Buffer&& other) noexcept;
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
  ~Buffer();

  std::span<const std::byte> bytes() const { return {data_, size_}; }
  std::span<std::byte> bytes() { return {data_, size_}; }
  std::size_t size() const { return size_; }

 private:
  void reset() noexcept;

  std::byte* data_ = nullptr;
  std::size_t size_ = 0;
  Release release_;
};

}  // namespace hiprt::build
