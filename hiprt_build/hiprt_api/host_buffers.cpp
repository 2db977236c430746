#include <hiprt_build/hiprt_api/host_buffers.h>

#include <algorithm>

namespace hiprt::api {

Result<std::unique_ptr<HostBuffer>> HostBuffer::make(std::size_t bytes) {
  std::unique_ptr<HostBuffer> made(new HostBuffer);
  auto event = gpu::Event::make();
  if (!event) return tl::unexpected(std::move(event.error()));
  made->passed_ = std::move(*event);
  void* pointer = nullptr;
  // Kernels write to it, and the host reads that when the stream has passed them.
  if (auto got = gpu::check(hipHostMalloc(&pointer, bytes, hipHostMallocCoherent), "hipHostMalloc", bytes, " bytes");
      !got)
    return tl::unexpected(std::move(got.error()));
  made->data_ = static_cast<std::byte*>(pointer);
  made->size_ = bytes;
  return made;
}

HostBuffer::~HostBuffer() {
  if (data_ != nullptr) gpu::error_detail::ignore(hipHostFree(data_));
}

Result<std::unique_ptr<HostBuffer>> HostBuffers::take(std::size_t bytes) {
  constexpr std::size_t kPage = 4096;
  const std::scoped_lock lock(mutex_);
  const auto unused = [](const auto& buffer) { return buffer->is_unused(); };
  auto found = std::find_if(buffers_.begin(), buffers_.end(),
                            [&](const auto& buffer) { return buffer->size() >= bytes && unused(buffer); });
  if (found != buffers_.end()) {
    std::unique_ptr<HostBuffer> taken = std::move(*found);
    buffers_.erase(found);
    return taken;
  }
  // One that is too small makes room.
  found = std::find_if(buffers_.begin(), buffers_.end(), unused);
  if (found != buffers_.end()) buffers_.erase(found);
  return HostBuffer::make((bytes + kPage - 1) / kPage * kPage);
}

void HostBuffers::give_back(std::unique_ptr<HostBuffer> buffer) {
  const std::scoped_lock lock(mutex_);
  buffers_.push_back(std::move(buffer));
}

void HostBuffers::clear() {
  const std::scoped_lock lock(mutex_);
  buffers_.clear();
}

}  // namespace hiprt::api
