#pragma once
/// Arrays as programs have them: elements at a constant distance in memory, such as positions inside vertex records.

#include <hiprt_device/format/node.h>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

namespace hiprt::build {

/// A view of elements that lie @p stride bytes apart. A vector, an array or a std::span converts to it.
///
///     struct Vertex { float position[3], normal[3]; };
///     mesh.positions = {vertices.data(), vertices.size(), sizeof(Vertex)};
///
/// @tparam T of numbers of 4 bytes: std::array of floats or of std::uint32_t.
template <class T> class StridedSpan {
 public:
  constexpr StridedSpan() = default;
  /// An array without gaps.
  template <class Range>
  requires(!std::same_as<Range, StridedSpan> && std::constructible_from<std::span<const T>, const Range&>)
      // NOLINTNEXTLINE(google-explicit-constructor)
      constexpr StridedSpan(const Range& range)
      : StridedSpan(std::span<const T>(range)) {}
  // NOLINTNEXTLINE(google-explicit-constructor)
  constexpr StridedSpan(std::span<const T> elements) : first_(elements.data()), size_(elements.size()) {}
  /// An array without gaps.
  constexpr StridedSpan(const T* first, std::size_t size) : first_(first), size_(size) {}
  /// @param first of the numbers of element 0, aligned to 4 bytes. Only the bytes of elements are read.
  /// @param stride in bytes from one element to the next: a multiple of 4, at least sizeof(T), less than 2^32.
  constexpr StridedSpan(const void* first, std::size_t size, std::size_t stride)
      : first_(first), size_(size), stride_(stride) {}

  constexpr std::size_t size() const { return size_; }
  constexpr bool empty() const { return size_ == 0; }
  constexpr std::size_t stride() const { return stride_; }
  constexpr const void* data() const { return first_; }
  constexpr bool has_gaps() const { return stride_ != sizeof(T); }
  /// @pre !has_gaps()
  std::span<const T> contiguous() const { return {static_cast<const T*>(first_), size_}; }
  const T& operator[](std::size_t i) const {
    return *reinterpret_cast<const T*>(static_cast<const std::byte*>(first_) + i * stride_);
  }

 private:
  const void* first_ = nullptr;
  std::size_t size_ = 0, stride_ = sizeof(T);
};

/// A view of boxes: two corners of three floats each, the lower and then the upper. A vector, an array or a std::span
/// of Box converts to it. Boxes of two float4 have a stride of 32 bytes and the upper corner at byte 16.
class BoxSpan {
 public:
  constexpr BoxSpan() = default;
  template <class Range>
  requires(!std::same_as<Range, BoxSpan> && std::constructible_from<std::span<const Box>, const Range&>)
      // NOLINTNEXTLINE(google-explicit-constructor)
      constexpr BoxSpan(const Range& range)
      : BoxSpan(std::span<const Box>(range)) {}
  // NOLINTNEXTLINE(google-explicit-constructor)
  constexpr BoxSpan(std::span<const Box> boxes) : first_(boxes.data()), size_(boxes.size()) {}
  /// An array without gaps.
  constexpr BoxSpan(const Box* first, std::size_t size) : first_(first), size_(size) {}
  /// @param first the lower corner of box 0, aligned to 4 bytes.
  /// @param stride in bytes from one box to the next: a multiple of 4, less than 2^32.
  /// @param upper offset in bytes of a box's upper corner: a multiple of 4, from 12 to stride - 12.
  constexpr BoxSpan(const void* first, std::size_t size, std::size_t stride, std::size_t upper = sizeof(float[3]))
      : first_(first), size_(size), stride_(stride), upper_(upper) {}

  constexpr std::size_t size() const { return size_; }
  constexpr bool empty() const { return size_ == 0; }
  constexpr std::size_t stride() const { return stride_; }
  constexpr std::size_t upper() const { return upper_; }
  constexpr const void* data() const { return first_; }
  constexpr bool has_gaps() const { return stride_ != sizeof(Box) || upper_ != sizeof(float[3]); }
  Box operator[](std::size_t i) const {
    const auto* box = static_cast<const std::byte*>(first_) + i * stride_;
    const auto *min = reinterpret_cast<const float*>(box), *max = reinterpret_cast<const float*>(box + upper_);
    return Box{{min[0], min[1], min[2]}, {max[0], max[1], max[2]}};
  }

 private:
  const void* first_ = nullptr;
  std::size_t size_ = 0, stride_ = sizeof(Box), upper_ = sizeof(float[3]);
};

}  // namespace hiprt::build
