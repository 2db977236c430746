#pragma once
/// Where things are in the memory of a build. Internal.

#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_build/gpu/build.h>
#include <hiprt_device/format/layout.h>

namespace hiprt::gpu {

inline constexpr std::uint64_t kHeaderBytes = sizeof(FileHeader) + 5 * sizeof(SectionEntry);

inline std::uint64_t align(std::uint64_t offset, std::uint64_t to) { return (offset + to - 1) / to * to; }

/// Hands out pieces of memory, one behind the other; without memory it counts.
class Pieces {
 public:
  explicit Pieces(std::byte* base = nullptr) : base_(base) {}

  template <class T> T* take(std::uint64_t count) {
    const std::uint64_t at = align(size_, kDeviceAlignment);
    size_ = at + count * sizeof(T);
    return base_ == nullptr ? nullptr : reinterpret_cast<T*>(base_ + at);
  }
  /// What is taken from here on lies behind what @p other, a copy from before, has handed out too.
  void pass(const Pieces& other) { size_ = size_ > other.size_ ? size_ : other.size_; }
  std::uint64_t size() const { return align(size_, kDeviceAlignment); }

 private:
  std::byte* base_;
  std::uint64_t size_ = 0;
};

/// Places of the file's sections.
struct FilePlaces {
  SectionEntry sections[5];
  std::uint64_t size;  ///< Of the file.

  FilePlaces(NodeLayout layout, std::uint64_t nodes, std::uint64_t leaves, std::uint64_t primitives,
             std::uint64_t geometries) {
    const std::uint64_t counts[5] = {nodes, leaves, primitives, geometries, 0};
    const std::uint64_t strides[5] = {node_size(layout), sizeof(FloatLeaf), sizeof(std::uint32_t),
                                      sizeof(GeometryRecord), 1};
    size = kHeaderBytes;
    for (std::uint32_t i = 0; i < 5; ++i) {
      sections[i] =
          SectionEntry{i + 1, i == 4 ? 0 : kSectionRequired, align(size, kSectionAlignment), counts[i], strides[i]};
      size = sections[i].offset + counts[i] * strides[i];
    }
  }
};

/// Of every kind of build.
Result<void> check_options(const BuildOptions& options);

}  // namespace hiprt::gpu
