#include <tests/faults/failing_memory.h>

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace hiprt::checks {

namespace {

std::atomic<bool> counting{false};
std::atomic<std::uint64_t> calls{0}, chosen{0};
std::atomic<bool> rest{false};
std::atomic<std::int64_t> live{0};

bool fails() {
  if (!counting.load(std::memory_order_relaxed)) return false;
  const std::uint64_t number = calls.fetch_add(1) + 1, first = chosen;
  return first != 0 && (number == first || (rest && number > first));
}

void* allocate(std::size_t bytes, std::size_t alignment) noexcept {
  if (fails()) return nullptr;
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
  chosen = number;
  rest = failing == Failing::kRest;
  counting = true;
}

std::uint64_t stop_failing() {
  counting = false;
  return calls;
}

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
void* operator new(std::size_t bytes, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return allocate(bytes, std::size_t(alignment));
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
