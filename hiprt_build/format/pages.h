#pragma once
/// Memory of the builder's arrays and buffers. Internal.

#include <hiprt_device/format/buffer.h>

#include <cstddef>
#include <new>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace hiprt::build {

/// From this size on memory is asked for in pages of this size: they are fetched at once, not each 4 KiB when it is
/// first touched, and random accesses to a large tree or table do not wait for page tables.
inline constexpr std::size_t kHugePage = std::size_t{2} << 20;

constexpr std::align_val_t page_alignment(std::size_t size) {
  return std::align_val_t{size >= kHugePage ? kHugePage : std::size_t{kBufferAlignment}};
}

/// @return size bytes, not yet set, aligned to kBufferAlignment. Throws std::bad_alloc.
inline void* allocate_pages(std::size_t size) {
  void* memory = ::operator new(size, page_alignment(size));
#if defined(__linux__)
  // Advice: whether the system has such pages is its business.
  if (size >= kHugePage) ::madvise(memory, size / kHugePage * kHugePage, MADV_HUGEPAGE);
#endif
  return memory;
}

/// @param size as it was allocated.
inline void free_pages(void* memory, std::size_t size) { ::operator delete(memory, page_alignment(size)); }

}  // namespace hiprt::build
