#pragma once
/// Device memory of the library's objects, and the caller's scratch memory. Internal.

#include <hiprt_build/gpu/allocator.h>

#include <cstdint>
#include <vector>

namespace hiprt::api {

using build::ErrorCode;
using build::Result;

/// Aligns objects and scratch memory.
inline constexpr std::size_t kAlignment = gpu::kDeviceAlignment;

inline std::uint64_t align_up(std::uint64_t bytes) { return (bytes + kAlignment - 1) / kAlignment * kAlignment; }

inline std::byte* aligned(void* pointer) {
  const auto address = reinterpret_cast<std::uintptr_t>(pointer);
  return reinterpret_cast<std::byte*>(align_up(address));
}

/// Memory of hipMalloc(), which the destructor frees. The context must be current then.
class Allocation {
 public:
  Allocation() = default;
  Allocation(Allocation&& other) noexcept : data_(other.data_), size_(other.size_) { other.data_ = nullptr; }
  Allocation& operator=(Allocation&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  ~Allocation() {
    if (data_ != nullptr) gpu::error_detail::ignore(hipFree(data_));
  }

  static Result<Allocation> make(std::uint64_t bytes) {
    Allocation made;
    void* pointer = nullptr;
    if (auto got = gpu::check(hipMalloc(&pointer, static_cast<std::size_t>(bytes)), "hipMalloc", bytes, " bytes"); !got)
      return tl::unexpected(std::move(got.error()));
    made.data_ = static_cast<std::byte*>(pointer);
    made.size_ = bytes;
    return made;
  }

  std::byte* data() const { return data_; }
  std::uint64_t size() const { return size_; }
  /// The memory stays until the driver's context ends.
  void abandon() { data_ = nullptr; }

 private:
  std::byte* data_ = nullptr;
  std::uint64_t size_ = 0;
};

/// Gives memory with room in front of it, for headers. What is adopted outlives the buffer that it was made for.
class HeadroomAllocator final : public gpu::Allocator {
 public:
  /// @param headroom bytes, a multiple of kAlignment.
  explicit HeadroomAllocator(std::uint64_t headroom) : headroom_(headroom) {}

  Result<void*> allocate(std::size_t bytes, std::size_t, hipStream_t) override {
    auto made = Allocation::make(headroom_ + bytes);
    if (!made) return tl::unexpected(std::move(made.error()));
    void* const pointer = made->data() + headroom_;
    memory_.push_back(std::move(*made));
    return pointer;
  }
  void free(void*, hipStream_t) noexcept override {}

  /// The whole memory that a pointer of allocate() is in. The rest is freed with the allocator.
  Allocation adopt(const void* pointer) {
    for (Allocation& memory : memory_)
      if (memory.data() != nullptr && memory.data() + headroom_ == pointer) return std::move(memory);
    return {};
  }

 private:
  std::uint64_t headroom_;
  std::vector<Allocation> memory_;
};

/// The caller's temporary buffer, aligned. Where the caller has none, memory of the stream's.
class Scratch {
 public:
  Scratch(void* buffer, hipStream_t stream) : data_(aligned(buffer)), stream_(stream) {}
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch() { release(); }

  /// @return the buffer, which the caller trusts to have so many bytes.
  Result<std::byte*> of_size(std::uint64_t bytes) {
    if (data_ != nullptr && (own_ == nullptr || bytes <= own_size_)) return data_;
    release();
    const auto size = static_cast<std::size_t>(bytes);
    hipError_t status = hipMallocAsync(&own_, size, stream_);
    of_stream_ = status == hipSuccess;
    // Some devices have no pools.
    if (!of_stream_ && status != hipErrorOutOfMemory) status = hipMalloc(&own_, size);
    if (auto got = gpu::check(status, "hipMallocAsync", bytes, " bytes"); !got) {
      own_ = nullptr;
      return tl::unexpected(std::move(got.error()));
    }
    own_size_ = bytes;
    return data_ = static_cast<std::byte*>(own_);
  }

 private:
  void release() {
    if (own_ == nullptr) return;
    if (!of_stream_) gpu::error_detail::ignore(hipStreamSynchronize(stream_));
    gpu::error_detail::ignore(of_stream_ ? hipFreeAsync(own_, stream_) : hipFree(own_));
    own_ = nullptr;
    data_ = nullptr;
  }

  std::byte* data_;
  hipStream_t stream_;
  void* own_ = nullptr;
  std::uint64_t own_size_ = 0;
  bool of_stream_ = false;
};

}  // namespace hiprt::api
