#pragma once
/// HIPRT's stack classes.
///
/// A traversal with one of them uses this library's private stack, which fits every scene. So their buffers may be
/// small or null. The members work on this memory, for programs that call them:
///
/// - Private stacks: the thread's own memory.
/// - Global stacks: the shared buffer, then the global buffer.
/// - Dynamic stacks: the thread's own memory. The buffers are not touched.

#include <hiprt/hiprt_types.h>
#include <hiprt_device/format/portability.h>

namespace hiprt::compat_detail {

/// A stack in the thread's own memory.
template <class T, uint32_t kEntries> class ArrayStack {
 public:
  HIPRT_HD T pop() { return entries_[--size_]; }
  HIPRT_HD void push(const T& entry) { entries_[size_++] = entry; }
  HIPRT_HD bool empty() const { return size_ == 0u; }
  HIPRT_HD uint32_t vacancy() const { return kEntries - size_; }
  HIPRT_HD void reset() { size_ = 0u; }

 private:
  T entries_[kEntries];
  uint32_t size_ = 0u;
};

/// A thread's place in its block and its grid. On a host there is one thread.
struct ThreadPlace {
#if HIPRT_DEVICE_CODE
  HIPRT_HD static uint32_t in_block() { return threadIdx.x + blockDim.x * (threadIdx.y + blockDim.y * threadIdx.z); }
  HIPRT_HD static uint32_t block_size() { return blockDim.x * blockDim.y * blockDim.z; }
  HIPRT_HD static uint32_t block() { return blockIdx.x + gridDim.x * blockIdx.y; }
  static constexpr uint32_t kLanes = WarpSize;
#else
  HIPRT_HD static uint32_t in_block() { return 0u; }
  HIPRT_HD static uint32_t block_size() { return 1u; }
  HIPRT_HD static uint32_t block() { return 0u; }
  static constexpr uint32_t kLanes = 1u;
#endif
};

/// A stack in shared memory, whose further entries are in global memory.
template <class T> class BufferStack {
 public:
  HIPRT_HD BufferStack(hiprtGlobalStackBuffer global, hiprtSharedStackBuffer shared)
      : shared_size_(shared.stackData == nullptr ? 0u : shared.stackSize),
        capacity_(shared_size_ + (global.stackData == nullptr ? 0u : global.stackSize)) {
    constexpr uint32_t kLanes = ThreadPlace::kLanes;
    const uint32_t thread = ThreadPlace::in_block(), lane = thread % kLanes, first = thread - lane;
    shared_ = static_cast<T*>(shared.stackData) + (first * shared_size_ + lane);
    const size_t of_wave = static_cast<size_t>(ThreadPlace::block()) * ThreadPlace::block_size() + first;
    global_ = static_cast<T*>(global.stackData) + (of_wave * global.stackSize + lane);
  }
  HIPRT_HD T pop() { return at(--size_); }
  HIPRT_HD void push(const T& entry) { at(size_++) = entry; }
  HIPRT_HD bool empty() const { return size_ == 0u; }
  HIPRT_HD uint32_t vacancy() const { return capacity_ - size_; }
  HIPRT_HD void reset() { size_ = 0u; }

 private:
  HIPRT_HD T& at(uint32_t i) {
    if (i < shared_size_) return shared_[i * ThreadPlace::kLanes];
    return global_[static_cast<size_t>(i - shared_size_) * ThreadPlace::kLanes];
  }

  T* shared_;
  T* global_;
  uint32_t shared_size_, capacity_, size_ = 0u;
};

}  // namespace hiprt::compat_detail

/// 64 entries in the thread's own memory.
class hiprtPrivateStack : public hiprt::compat_detail::ArrayStack<uint32_t, 64u> {
 public:
  static constexpr uint32_t StackSize = 64u;
};
/// See the head of this file.
class hiprtGlobalStack : public hiprt::compat_detail::BufferStack<uint32_t> {
 public:
  using BufferStack::BufferStack;
};
/// See the head of this file.
class hiprtDynamicStack : public hiprt::compat_detail::ArrayStack<uint32_t, 64u> {
 public:
  HIPRT_HD hiprtDynamicStack(hiprtGlobalStackBuffer, hiprtSharedStackBuffer) {}
};

/// The instances of a scene of scenes, in the thread's own memory.
class hiprtPrivateInstanceStack : public hiprt::compat_detail::ArrayStack<hiprtInstanceStackEntry, 3u> {};
/// See the head of this file.
class hiprtGlobalInstanceStack : public hiprt::compat_detail::BufferStack<hiprtInstanceStackEntry> {
 public:
  using BufferStack::BufferStack;
};
/// See the head of this file.
class hiprtDynamicInstanceStack : public hiprt::compat_detail::ArrayStack<hiprtInstanceStackEntry, 3u> {
 public:
  HIPRT_HD hiprtDynamicInstanceStack(hiprtGlobalStackBuffer, hiprtSharedStackBuffer) {}
};
/// HIPRT has it for scenes with one level of instances. Here such scenes may have more.
class hiprtEmptyInstanceStack {
 public:
  HIPRT_HD hiprtInstanceStackEntry pop() { return hiprtInstanceStackEntry{}; }
  HIPRT_HD void push(const hiprtInstanceStackEntry&) {}
  HIPRT_HD bool empty() const { return true; }
  HIPRT_HD uint32_t vacancy() const { return 0u; }
  HIPRT_HD void reset() {}
};

namespace hiprt::compat_detail {

/// Whether a stack is one of the classes above, which a traversal replaces.
template <class Stack> inline constexpr bool kIsNamedStack = false;
template <> inline constexpr bool kIsNamedStack<hiprtPrivateStack> = true;
template <> inline constexpr bool kIsNamedStack<hiprtGlobalStack> = true;
template <> inline constexpr bool kIsNamedStack<hiprtDynamicStack> = true;

}  // namespace hiprt::compat_detail
