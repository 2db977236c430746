#pragma once
/// Scratch memory of the GPU builders. Internal.

#include <hiprt_build/format/file_layout.h>
#include <hiprt_build/gpu/device_buffer.h>

#include <cstddef>
#include <cstdint>

namespace hiprt::gpu {

/// Hands out arrays of a block of memory, one behind the other, each aligned to kDeviceAlignment. Without memory it
/// counts how much is needed.
class Arena {
 public:
  explicit Arena(std::byte* base = nullptr) : base_(base) {}

  template <class T> T* take(std::uint64_t count) {
    const std::uint64_t at = align_up(size_, kDeviceAlignment);
    size_ = at + count * sizeof(T);
    return base_ == nullptr ? nullptr : reinterpret_cast<T*>(base_ + at);
  }
  /// What is taken from here on lies behind what @p other, an earlier copy, has handed out too.
  void skip(const Arena& other) { size_ = size_ > other.size_ ? size_ : other.size_; }
  std::uint64_t size() const { return align_up(size_, kDeviceAlignment); }

 private:
  std::byte* base_;
  std::uint64_t size_ = 0;
};

}  // namespace hiprt::gpu
