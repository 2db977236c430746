#pragma once
/// Memory of the builder's arrays and buffers. Internal.

#include <hiprt_build/format/out_of_memory.h>
#include <hiprt_device/format/buffer.h>

#include <cstddef>
#include <new>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace hiprt::build {

/// Allocations of this size and more use pages of this size. Large pages are mapped at once, not 4 KiB at a time when
/// they are first touched. Random accesses to a large tree or table then do not wait for page tables.
inline constexpr std::size_t kHugePage = std::size_t{2} << 20;

constexpr std::align_val_t page_alignment(std::size_t size) {
  return std::align_val_t{size >= kHugePage ? kHugePage : std::size_t{kBufferAlignment}};
}

/// @return size bytes, not initialised, aligned to kBufferAlignment. Throws AllocationFailed, a std::bad_alloc.
inline void* allocate_pages(std::size_t size) {
  void* memory = ::operator new(size, page_alignment(size), std::nothrow);
  if (memory == nullptr) throw AllocationFailed(size);
#if defined(__linux__)
  // This is advice: the system need not have such pages.
  if (size >= kHugePage) ::madvise(memory, size / kHugePage * kHugePage, MADV_HUGEPAGE);
#endif
  return memory;
}

/// @param size as it was allocated.
inline void free_pages(void* memory, std::size_t size) { ::operator delete(memory, page_alignment(size)); }

/// For containers of the standard library.
template <class T> struct PageAllocator {
  using value_type = T;

  PageAllocator() = default;
  template <class Other> explicit PageAllocator(const PageAllocator<Other>&) {}
  T* allocate(std::size_t count) { return static_cast<T*>(allocate_pages(count * sizeof(T))); }
  void deallocate(T* memory, std::size_t count) { free_pages(memory, count * sizeof(T)); }
  friend bool operator==(const PageAllocator&, const PageAllocator&) { return true; }
};

}  // namespace hiprt::build
