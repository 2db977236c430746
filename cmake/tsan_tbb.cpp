/// Tells the thread sanitizer what oneTBB guarantees. Linked into every program of the tsan preset, nowhere else.
///
/// Debian's libtbb.so is not instrumented. The sanitizer does not see that a task starts after its spawn, and that a
/// wait returns after the work. It would report every parallel loop. These functions replace libtbb's entry points in
/// the program: they tell the sanitizer that order and call the library. They state only the guarantees of oneTBB. Two
/// bodies of one loop stay unordered, so the sanitizer still reports races between them.

#include <dlfcn.h>
#include <oneapi/tbb/task_arena.h>
#include <oneapi/tbb/task_group.h>
#include <sanitizer/tsan_interface.h>

#include <cstdlib>

/// The sanitizer watches memset() and similar functions in every library. It shall ignore the calls of libtbb.
extern "C" const char* __tsan_default_suppressions() { return "called_from_lib:libtbb.so\n"; }

namespace tbb::detail::r1 {
namespace {

/// libtbb's own function of that (mangled) name.
template <class Function> Function* next(const char* name) {
  auto* function = reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
  if (function == nullptr) std::abort();
  return function;
}

/// Represents a spawned task until it runs.
class Announced final : public d1::task {
 public:
  explicit Announced(d1::task& original) : original_(&original) {}

 private:
  // After an exception of execute() libtbb calls cancel() of the same task.
  d1::task* execute(d1::execution_data& data) override {
    __tsan_acquire(this);
    d1::task* const following = original_->execute(data);
    delete this;
    return following;
  }
  d1::task* cancel(d1::execution_data& data) override {
    __tsan_acquire(this);
    d1::task* const following = original_->cancel(data);
    delete this;
    return following;
  }

  d1::task* original_;
};

/// From here on another thread may run the task and sees everything that this thread wrote before.
d1::task& announce(d1::task& original) {
  auto* announced = new Announced(original);
  __tsan_release(announced);
  return *announced;
}

/// The tasks count down (instrumented, in oneTBB's headers); libtbb reads the zero, and may pass on an exception then.
class AcquireCount {
 public:
  explicit AcquireCount(d1::wait_context& waited) : waited_(&waited) {}
  AcquireCount(const AcquireCount&) = delete;
  AcquireCount& operator=(const AcquireCount&) = delete;
  ~AcquireCount() {
    // The counter is private: it is the second of two 8-byte members.
    static_assert(sizeof(d1::wait_context) == 16);
    __tsan_acquire(reinterpret_cast<char*>(waited_) + 8);
  }

 private:
  d1::wait_context* waited_;
};

class Delegate final : public d1::delegate_base {
 public:
  explicit Delegate(d1::delegate_base& inner) : inner_(&inner) { __tsan_release(&inner); }

  bool operator()() const override {
    __tsan_acquire(inner_);
    const bool result = (*inner_)();
    __tsan_release(inner_);
    return result;
  }

 private:
  d1::delegate_base* inner_;
};

}  // namespace

void spawn(d1::task& task, d1::task_group_context& context) {
  static const auto original = next<void(d1::task&, d1::task_group_context&)>(
      "_ZN3tbb6detail2r15spawnERNS0_2d14taskERNS2_18task_group_contextE");
  original(announce(task), context);
}

void spawn(d1::task& task, d1::task_group_context& context, d1::slot_id slot) {
  static const auto original = next<void(d1::task&, d1::task_group_context&, d1::slot_id)>(
      "_ZN3tbb6detail2r15spawnERNS0_2d14taskERNS2_18task_group_contextEt");
  original(announce(task), context, slot);
}

void execute_and_wait(d1::task& task, d1::task_group_context& context, d1::wait_context& waited,
                      d1::task_group_context& waited_context) {
  static const auto original =
      next<void(d1::task&, d1::task_group_context&, d1::wait_context&, d1::task_group_context&)>(
          "_ZN3tbb6detail2r116execute_and_waitERNS0_2d14taskERNS2_18task_group_contextERNS2_12wait_contextES6_");
  const AcquireCount acquire(waited);
  original(announce(task), context, waited, waited_context);
}

void wait(d1::wait_context& waited, d1::task_group_context& context) {
  static const auto original = next<void(d1::wait_context&, d1::task_group_context&)>(
      "_ZN3tbb6detail2r14waitERNS0_2d112wait_contextERNS2_18task_group_contextE");
  const AcquireCount acquire(waited);
  original(waited, context);
}

void execute(d1::task_arena_base& arena, d1::delegate_base& delegate) {
  static const auto original = next<void(d1::task_arena_base&, d1::delegate_base&)>(
      "_ZN3tbb6detail2r17executeERNS0_2d115task_arena_baseERNS2_13delegate_baseE");
  Delegate wrapped(delegate);
  original(arena, wrapped);
  __tsan_acquire(&delegate);
}

// libtbb hands freed blocks from thread to thread; malloc's the sanitizer knows.
void* allocate(d1::small_object_pool*& pool, std::size_t bytes) {
  static d1::small_object_pool* none = reinterpret_cast<d1::small_object_pool*>(&none);
  pool = none;
  return std::aligned_alloc(64, (bytes + 63) / 64 * 64);
}
void* allocate(d1::small_object_pool*& pool, std::size_t bytes, const d1::execution_data&) {
  return allocate(pool, bytes);
}
void deallocate(d1::small_object_pool&, void* block, std::size_t) { std::free(block); }
void deallocate(d1::small_object_pool&, void* block, std::size_t, const d1::execution_data&) { std::free(block); }

}  // namespace tbb::detail::r1
