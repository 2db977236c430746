#include <tests/faults/failing_memory.h>

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace hiprt::checks {

namespace {

std::atomic<bool> counting{false};
std::atomic<std::uint64_t> calls{0}, chosen{0}, array{0};
std::atomic<bool> rest{false};
std::atomic<std::int64_t> live{0};

/// @param array_bytes of an array of build::allocate_pages(); 0: it is none.
bool fails(std::uint64_t array_bytes) {
  if (!counting.load(std::memory_order_relaxed)) return false;
  const std::uint64_t number = calls.fetch_add(1) + 1, first = chosen;
  if (number == first) array = array_bytes;
  return first != 0 && (number == first || (rest && number > first));
}

void* allocate(std::size_t bytes, std::size_t alignment, bool is_array = false) noexcept {
  if (fails(is_array ? bytes : 0)) return nullptr;
  void* const memory = alignment == 0 ? std::malloc(bytes + (bytes == 0))
                                      : std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
  if (memory != nullptr) ++live;
  return memory;
}

void* must_allocate(std::size_t bytes, std::size_t alignment) {
  void* const memory = allocate(bytes, alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

void release(void* memory) noexcept {
  if (memory == nullptr) return;
  --live;
  std::free(memory);
}

}  // namespace

void start_failing(std::uint64_t number, Failing failing) {
  calls = 0;
  array = 0;
  chosen = number;
  rest = failing == Failing::kRest;
  counting = true;
}

std::uint64_t stop_failing() {
  counting = false;
  return calls;
}

std::uint64_t failed_array() { return array; }

std::int64_t live_allocations() { return live; }

}  // namespace hiprt::checks

using hiprt::checks::allocate, hiprt::checks::must_allocate, hiprt::checks::release;

void* operator new(std::size_t bytes) { return must_allocate(bytes, 0); }
void* operator new[](std::size_t bytes) { return must_allocate(bytes, 0); }
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return must_allocate(bytes, std::size_t(alignment));
}
void* operator new[](std::size_t bytes, std::align_val_t alignment) {
  return must_allocate(bytes, std::size_t(alignment));
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return allocate(bytes, 0); }
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept { return allocate(bytes, 0); }
// Only build::allocate_pages() calls it.
void* operator new(std::size_t bytes, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return allocate(bytes, std::size_t(alignment), true);
}
void* operator new[](std::size_t bytes, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return allocate(bytes, std::size_t(alignment));
}
void operator delete(void* memory) noexcept { release(memory); }
void operator delete[](void* memory) noexcept { release(memory); }
void operator delete(void* memory, std::size_t) noexcept { release(memory); }
void operator delete[](void* memory, std::size_t) noexcept { release(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { release(memory); }
void operator delete[](void* memory, const std::nothrow_t&) noexcept { release(memory); }
void operator delete(void* memory, std::align_val_t, const std::nothrow_t&) noexcept { release(memory); }
void operator delete[](void* memory, std::align_val_t, const std::nothrow_t&) noexcept { release(memory); }
