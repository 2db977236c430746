#include <hiprt_build/buffer.h>
#include <hiprt_build/format/pages.h>

#include <cstring>
#include <utility>

namespace hiprt::build {

Buffer::Buffer(std::size_t size) : Buffer(uninitialized(size)) {
  if (size != 0) std::memset(data_, 0, size);
}

Buffer Buffer::uninitialized(std::size_t size) {
  Buffer buffer;
  if (size == 0) return buffer;
  buffer.data_ = static_cast<std::byte*>(allocate_pages(size));
  buffer.size_ = size;
  return buffer;
}

Buffer::Buffer(std::byte* data, std::size_t size, Release release)
    : data_(data), size_(size), release_(std::move(release)) {}

Buffer::Buffer(Buffer&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)),
      size_(std::exchange(other.size_, 0)),
      release_(std::exchange(other.release_, nullptr)) {}

Buffer& Buffer::operator=(Buffer&& other) noexcept {
  if (this == &other) return *this;
  reset();
  data_ = std::exchange(other.data_, nullptr);
  size_ = std::exchange(other.size_, 0);
  release_ = std::exchange(other.release_, nullptr);
  return *this;
}

Buffer::~Buffer() { reset(); }

void Buffer::reset() noexcept {
  if (data_ != nullptr) {
    if (release_)
      release_(data_, size_);
    else
      free_pages(data_, size_);
  }
  data_ = nullptr;
  size_ = 0;
  release_ = nullptr;
}

}  // namespace hiprt::build
