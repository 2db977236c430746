#pragma once
/// Pinned host memory for copies that the host does not wait for. Internal.

#include <hiprt_build/gpu/event.h>

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

namespace hiprt::api {

using build::Result;

/// A piece of pinned memory, and the point in a stream after which it is unused.
class HostBuffer {
 public:
  static Result<std::unique_ptr<HostBuffer>> make(std::size_t bytes);
  HostBuffer(const HostBuffer&) = delete;
  HostBuffer& operator=(const HostBuffer&) = delete;
  ~HostBuffer();

  std::byte* data() const { return data_; }
  std::size_t size() const { return size_; }
  Result<void> record(hipStream_t stream) { return passed_.record(stream); }
  Result<void> wait() const { return passed_.synchronize(); }
  bool is_unused() const { return passed_.is_reached(); }

 private:
  HostBuffer() = default;
  std::byte* data_ = nullptr;
  std::size_t size_ = 0;
  gpu::Event passed_;
};

/// The buffers of a context, kept from call to call. Threads may use it at the same time.
class HostBuffers {
 public:
  /// @return a buffer of at least so many bytes that nothing uses.
  Result<std::unique_ptr<HostBuffer>> take(std::size_t bytes);
  /// @param buffer its use ends where it was recorded.
  void give_back(std::unique_ptr<HostBuffer> buffer);
  /// Frees all. The context must be current.
  void clear();

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<HostBuffer>> buffers_;
};

}  // namespace hiprt::api
