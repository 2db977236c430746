#pragma once
/// A stack whose first entries are in a block's shared memory (LDS) and whose other entries are in the thread's own
/// memory.

#include <hiprt_device/math/memory.h>
#include <hiprt_device/traverse/stacks/stack.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// A stack for divergent rays on NVIDIA GPUs.
///
/// NVIDIA's local memory puts the same word of all lanes side by side. Lanes whose stacks differ in size use four
/// bytes of every 32-byte sector that they move, and the stacks fill the L1 cache. In scenes of many instances this
/// stack is faster than a PrivateStack; with coherent rays it is slower. docs/decisions/0010-traversal-on-gpus.md has
/// the numbers. On AMD GPUs it was not measured.
/// @tparam kShared entries in shared memory: those at the bottom of the stack.
/// @tparam kEntries capacity.
///
///     __shared__ hiprt::StackEntry entries[kBlock * hiprt::TieredStack<16>::kEntriesPerThread];
///     hiprt::TieredStack<16>::Memory memory;
///     hiprt::TieredStack<16>::Storage storage(entries, threadIdx.x, kBlock, memory);
template <unsigned kShared = 16, unsigned kEntries = 192> struct TieredStack {
  static_assert(kShared >= 1 && kShared < kEntries, "hiprt: TieredStack: kShared must be from 1 to kEntries - 1");
  static constexpr unsigned kEntriesPerThread = kShared;

  struct Memory {
    StackEntry entries[kEntries + 1 - kShared];
  };

  struct Storage : OverflowCount {
    StackEntry* block;  ///< kEntriesPerThread * threads entries of shared memory.
    unsigned thread;    ///< This thread's number in its block.
    unsigned threads;   ///< Number of threads of the block.
    StackEntry* own;

    /// @param memory must live as long as the traversal.
    HIPRT_HD HIPRT_FORCE_INLINE Storage(StackEntry* block_entries, unsigned block_thread, unsigned block_threads,
                                        Memory& memory, std::uint32_t* overflowed = nullptr)
        : OverflowCount{overflowed},
          block(block_entries),
          thread(block_thread),
          threads(block_threads),
          own(memory.entries) {}
  };

  template <class Entry> class Of {
   public:
    static constexpr bool kHasBottom = true;

    HIPRT_HD HIPRT_FORCE_INLINE explicit Of(const Storage& storage)
        : shared_(reinterpret_cast<Entry*>(storage.block) + storage.thread),
          threads_(storage.threads),
          own_(storage.own) {
      store_shared(shared_, 0, bottom_entry<Entry>());
    }
    HIPRT_HD HIPRT_FORCE_INLINE bool has_room() const { return size_ + kMostPushed <= kEntries + 1; }
    HIPRT_HD HIPRT_FORCE_INLINE void push(Entry entry) {
      if (size_ < kShared)
        store_shared(shared_, size_ * threads_, entry);
      else
        own_[size_ - kShared] = entry;
      ++size_;
    }
    /// Checks once for all entries of a node: mostly they fit in shared memory.
    template <class Each> HIPRT_HD HIPRT_FORCE_INLINE void push_some(Each&& each) {
      if (size_ + kMostPushed <= kShared)
        each([&](Entry entry) HIPRT_FORCE_INLINE_LAMBDA { store_shared(shared_, size_++ * threads_, entry); });
      else
        each([&](Entry entry) HIPRT_FORCE_INLINE_LAMBDA { push(entry); });
    }
    HIPRT_HD HIPRT_FORCE_INLINE Entry pop() {
      const unsigned top = size_ - 1;
      size_ = top > 1 ? top : 1;
      if (top < kShared) return load_shared(shared_, top * threads_);
      return static_cast<Entry>(own_[top - kShared]);
    }
    HIPRT_HD HIPRT_FORCE_INLINE bool empty() const { return size_ == 1; }

   private:
    Entry* shared_;
    unsigned threads_;
    StackEntry* own_;
    unsigned size_ = 1;  ///< Includes the bottom entry.
  };
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
