#pragma once
/// Where device memory comes from: the caller decides.

#include <hiprt_build/gpu/error.h>

#include <cstddef>

namespace hiprt::gpu {

/// What every allocator must be able to align to: the ray instructions of AMD and vector loads need no more.
inline constexpr std::size_t kDeviceAlignment = 256;

/// A source of memory on the current device. Must outlive everything that was allocated from it. Implementations say
/// themselves whether several threads may use one at the same time.
class Allocator {
 public:
  Allocator() = default;
  Allocator(const Allocator&) = delete;
  Allocator& operator=(const Allocator&) = delete;
  virtual ~Allocator() = default;

  /// @param bytes more than 0.
  /// @param alignment a power of two, up to kDeviceAlignment.
  /// @param stream whose work may use the memory first.
  /// @return the memory, not cleared; kOutOfMemory with the bytes wanted and free, or another error.
  virtual Result<void*> allocate(std::size_t bytes, std::size_t alignment, hipStream_t stream) = 0;

  /// Takes memory back once all work has passed that is in @p stream now.
  /// @param pointer from allocate(), or nullptr.
  virtual void free(void* pointer, hipStream_t stream) noexcept = 0;
};

namespace allocator_detail {

inline Result<void> check_alignment(std::size_t alignment) {
  if (alignment != 0 && (alignment & (alignment - 1)) == 0 && alignment <= kDeviceAlignment) return {};
  return fail(ErrorCode::kInvalidInput, "alignment ", alignment, ": not a power of two up to ", kDeviceAlignment);
}

}  // namespace allocator_detail

/// hipMalloc and hipFree: the memory can be used on every stream; freeing waits for the stream. Any number of threads.
class DeviceAllocator final : public Allocator {
 public:
  Result<void*> allocate(std::size_t bytes, std::size_t alignment, hipStream_t) override {
    if (auto aligned = allocator_detail::check_alignment(alignment); !aligned) return tl::unexpected(aligned.error());
    void* pointer = nullptr;
    if (auto got = check(hipMalloc(&pointer, bytes), "hipMalloc", bytes, " bytes wanted"); !got)
      return tl::unexpected(got.error());
    return pointer;
  }

  void free(void* pointer, hipStream_t stream) noexcept override {
    if (pointer == nullptr) return;
    // A failed kernel fails these calls too; whoever waits for that kernel is told.
    error_detail::ignore(hipStreamSynchronize(stream));
    error_detail::ignore(hipFree(pointer));
  }
};

/// hipMallocAsync and hipFreeAsync: nobody waits, and the driver keeps freed memory for the next allocation. Work on
/// other streams must be ordered behind @p stream by events. Any number of threads.
class StreamAllocator final : public Allocator {
 public:
  Result<void*> allocate(std::size_t bytes, std::size_t alignment, hipStream_t stream) override {
    if (auto aligned = allocator_detail::check_alignment(alignment); !aligned) return tl::unexpected(aligned.error());
    void* pointer = nullptr;
    if (auto got = check(hipMallocAsync(&pointer, bytes, stream), "hipMallocAsync", bytes, " bytes wanted"); !got)
      return tl::unexpected(got.error());
    return pointer;
  }

  void free(void* pointer, hipStream_t stream) noexcept override {
    if (pointer != nullptr) error_detail::ignore(hipFreeAsync(pointer, stream));
  }
};

}  // namespace hiprt::gpu
