#pragma once
/// Owners of device memory. Copies go through the caller's stream and return before they are done. Host memory of a
/// copy must live until the stream has passed the copy.

#include <hiprt_build/gpu/allocator.h>

#include <cstdint>
#include <limits>
#include <new>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace hiprt::gpu {

/// Move-only bytes on the device. The destructor gives them back to their allocator, on their stream; both must live
/// until then.
class DeviceBuffer {
 public:
  /// An empty buffer; needs no device.
  DeviceBuffer() = default;

  /// @param bytes may be 0: then nothing is allocated. The content is undefined.
  /// @param stream on which the memory is given back; see free_on().
  /// @param alignment a power of two, up to kDeviceAlignment.
  /// @return the allocator's error, or kInvalidInput if the allocator does not align as asked.
  static Result<DeviceBuffer> make(std::size_t bytes, hipStream_t stream, Allocator& allocator,
                                   std::size_t alignment = kDeviceAlignment) {
    DeviceBuffer buffer;
    if (bytes == 0) return buffer;
    auto memory = allocator.allocate(bytes, alignment, stream);
    if (!memory) return tl::unexpected(std::move(memory.error()));
    buffer.data_ = static_cast<std::byte*>(*memory);
    buffer.size_ = bytes;
    buffer.stream_ = stream;
    buffer.allocator_ = &allocator;
    const std::uintptr_t excess = reinterpret_cast<std::uintptr_t>(*memory) % alignment;
    if (*memory == nullptr || excess != 0)
      return fail(ErrorCode::kInvalidInput, "the allocator returned an address ", excess,
                  " bytes behind a multiple of ", alignment, ", or nullptr, for ", bytes, " bytes");
    return buffer;
  }

  DeviceBuffer(DeviceBuffer&& other) noexcept { swap(other); }
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    if (this != &other) {
      release();
      swap(other);
    }
    return *this;
  }
  DeviceBuffer(const DeviceBuffer&) = delete;
  DeviceBuffer& operator=(const DeviceBuffer&) = delete;
  ~DeviceBuffer() { release(); }

  /// Gives the memory back now and leaves the buffer empty.
  void release() noexcept {
    if (allocator_ != nullptr) allocator_->free(data_, stream_);
    data_ = nullptr;
    size_ = 0;
    stream_ = nullptr;
    allocator_ = nullptr;
  }

  /// The memory will be given back on @p stream. Pass the stream whose work uses it last.
  void free_on(hipStream_t stream) { stream_ = stream; }

  std::byte* data() { return data_; }  ///< On the device; nullptr if empty.
  const std::byte* data() const { return data_; }
  std::size_t size() const { return size_; }  ///< Bytes.
  bool empty() const { return size_ == 0; }

  /// Copies host to device. @return kInvalidInput if the copy would pass the end.
  Result<void> upload(std::span<const std::byte> from, hipStream_t stream, std::size_t offset = 0) {
    if (auto range = check_range("upload", offset, from.size()); !range || from.empty()) return range;
    return check(hipMemcpyAsync(data_ + offset, from.data(), from.size(), hipMemcpyHostToDevice, stream),
                 "hipMemcpyAsync", from.size(), " bytes to the device");
  }

  /// Copies device to host: @p to is filled once the stream is synchronized.
  /// @return kInvalidInput if the copy would pass the end.
  Result<void> download(std::span<std::byte> to, hipStream_t stream, std::size_t offset = 0) const {
    if (auto range = check_range("download", offset, to.size()); !range || to.empty()) return range;
    return check(hipMemcpyAsync(to.data(), data_ + offset, to.size(), hipMemcpyDeviceToHost, stream), "hipMemcpyAsync",
                 to.size(), " bytes from the device");
  }

  /// Sets every byte to @p value.
  Result<void> fill(std::byte value, hipStream_t stream) {
    if (empty()) return {};
    return check(hipMemsetAsync(data_, std::to_integer<int>(value), size_, stream), "hipMemsetAsync", size_, " bytes");
  }

 private:
  void swap(DeviceBuffer& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(stream_, other.stream_);
    std::swap(allocator_, other.allocator_);
  }

  Result<void> check_range(const char* what, std::size_t offset, std::size_t bytes) const {
    if (offset <= size_ && bytes <= size_ - offset) return {};
    return fail(ErrorCode::kInvalidInput, what, " of ", bytes, " bytes at byte ", offset, " of a buffer of ", size_,
                " bytes");
  }

  std::byte* data_ = nullptr;
  std::size_t size_ = 0;
  hipStream_t stream_ = nullptr;
  Allocator* allocator_ = nullptr;
};

/// Move-only array of trivially copyable elements on the device; see DeviceBuffer.
template <class T> class DeviceArray {
  static_assert(std::is_trivially_copyable_v<T> && !std::is_const_v<T>);
  static_assert(alignof(T) <= kDeviceAlignment);

 public:
  DeviceArray() = default;

  /// @param count elements, may be 0. Their values are undefined.
  /// @return kTooLarge if the bytes overflow, or the errors of DeviceBuffer::make().
  static Result<DeviceArray> make(std::size_t count, hipStream_t stream, Allocator& allocator) {
    if (count > std::numeric_limits<std::size_t>::max() / sizeof(T))
      return fail(ErrorCode::kTooLarge, count, " elements of ", sizeof(T), " bytes: more bytes than an address has");
    auto buffer = DeviceBuffer::make(count * sizeof(T), stream, allocator);
    if (!buffer) return tl::unexpected(std::move(buffer.error()));
    DeviceArray array;
    array.buffer_ = std::move(*buffer);
    return array;
  }

  /// Makes an array with copies of @p values, which must live until the stream has passed the copy.
  static Result<DeviceArray> from(std::span<const T> values, hipStream_t stream, Allocator& allocator) {
    auto array = make(values.size(), stream, allocator);
    if (!array) return array;
    if (auto copied = array->upload(values, stream); !copied) return tl::unexpected(std::move(copied.error()));
    return array;
  }

  void release() noexcept { buffer_.release(); }
  void free_on(hipStream_t stream) { buffer_.free_on(stream); }

  T* data() { return reinterpret_cast<T*>(buffer_.data()); }  ///< On the device; nullptr if empty.
  const T* data() const { return reinterpret_cast<const T*>(buffer_.data()); }
  std::size_t size() const { return buffer_.size() / sizeof(T); }  ///< Elements.
  std::size_t size_bytes() const { return buffer_.size(); }
  bool empty() const { return buffer_.empty(); }

  /// Copies host to device, from element @p first on. @return kInvalidInput if the copy would pass the end.
  Result<void> upload(std::span<const T> from, hipStream_t stream, std::size_t first = 0) {
    if (auto range = check_range("upload", first, from.size()); !range) return range;
    return buffer_.upload(std::as_bytes(from), stream, first * sizeof(T));
  }

  /// Copies device to host: @p to is filled once the stream is synchronized.
  /// @return kInvalidInput if the copy would pass the end.
  Result<void> download(std::span<T> to, hipStream_t stream, std::size_t first = 0) const {
    if (auto range = check_range("download", first, to.size()); !range) return range;
    return buffer_.download(std::as_writable_bytes(to), stream, first * sizeof(T));
  }

  /// Downloads all elements and waits for the stream. @return also the errors of earlier work on the stream.
  Result<std::vector<T>> to_vector(hipStream_t stream) const {
    std::vector<T> result;
    try {
      result.resize(size());
    } catch (const std::bad_alloc&) {
      return fail(ErrorCode::kOutOfMemory, size_bytes(), " bytes of host memory wanted for a download");
    }
    if (auto copied = download(result, stream); !copied) return tl::unexpected(std::move(copied.error()));
    if (auto passed = check(hipStreamSynchronize(stream), "hipStreamSynchronize"); !passed)
      return tl::unexpected(std::move(passed.error()));
    return result;
  }

  /// Sets every byte to @p value.
  Result<void> fill(std::byte value, hipStream_t stream) { return buffer_.fill(value, stream); }

 private:
  /// In elements, because a large count would overflow as bytes.
  Result<void> check_range(const char* what, std::size_t first, std::size_t count) const {
    if (first <= size() && count <= size() - first) return {};
    return fail(ErrorCode::kInvalidInput, what, " of ", count, " elements at element ", first, " of an array of ",
                size());
  }

  DeviceBuffer buffer_;
};

}  // namespace hiprt::gpu
