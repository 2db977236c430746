#include <hiprt_build/buffer.h>
#include <hiprt_device/format/buffer.h>

#include <cstring>
#include <new>
#include <utility>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace hiprt::build {

namespace {

/// From this size on a buffer asks for pages of this size: random accesses to a large tree wait for page tables.
constexpr std::size_t kHugePage = std::size_t{2} << 20;

constexpr std::align_val_t alignment(std::size_t size) {
  return std::align_val_t{size >= kHugePage ? kHugePage : std::size_t{kBufferAlignment}};
}

}  // namespace

Buffer::Buffer(std::size_t size) : Buffer(uninitialized(size)) {
  if (size != 0) std::memset(data_, 0, size);
}

Buffer Buffer::uninitialized(std::size_t size) {
  Buffer buffer;
  if (size == 0) return buffer;
  buffer.data_ = static_cast<std::byte*>(::operator new(size, alignment(size)));
  buffer.size_ = size;
#if defined(__linux__)
  // Advice: whether the system has such pages is its business.
  if (size >= kHugePage) ::madvise(buffer.data_, size / kHugePage * kHugePage, MADV_HUGEPAGE);
#endif
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
      ::operator delete(data_, alignment(size_));
  }
  data_ = nullptr;
  size_ = 0;
  release_ = nullptr;
}

}  // namespace hiprt::build
