#include <hiprt_build/buffer.h>
#include <hiprt_device/format/buffer.h>

#include <cstring>
#include <new>
#include <utility>

namespace hiprt::build {

namespace {
constexpr std::align_val_t kAlignment{kBufferAlignment};
}

Buffer::Buffer(std::size_t size) {
  if (size == 0) return;
  data_ = static_cast<std::byte*>(::operator new(size, kAlignment));
  size_ = size;
  std::memset(data_, 0, size);
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
      ::operator delete(data_, kAlignment);
  }
  data_ = nullptr;
  size_ = 0;
  release_ = nullptr;
}

}  // namespace hiprt::build
