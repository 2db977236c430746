#pragma once
/// Stack whose first entries are in a block's shared memory (LDS), and the others in the thread's own.

#include <hiprt_device/math/memory.h>
#include <hiprt_device/traverse/stacks/stack.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// For rays that part ways, on NVIDIA: local memory is laid out for lanes that go together, their words side by side.
/// Lanes whose stacks differ in size use four bytes of every sector of 32 that they move, and the L1 cache is full of
/// stacks. In scenes of many instances 1.02 to 1.14 times as fast as a PrivateStack; where lanes go together it is the
/// slower one, by up to 5 % (docs/decisions/0010-traversal-on-gpus.md). On AMD nothing is measured.
/// @tparam kShared entries in shared memory: those that a ray leaves first. @tparam kEntries capacity.
///
///     __shared__ hiprt::StackEntry entries[kBlock * hiprt::TieredStack<16>::kEntriesPerThread];
///     hiprt::TieredStack<16>::Memory memory;
///     hiprt::TieredStack<16>::Storage storage(entries, threadIdx.x, kBlock, memory);
template <unsigned kShared = 16, unsigned kEntries = 192> struct TieredStack {
  static_assert(kShared >= 1 && kShared < kEntries, "TieredStack: one entry at least is shared, and fewer than all");
  static constexpr unsigned kEntriesPerThread = kShared;

  struct Memory {
    StackEntry entries[kEntries + 1 - kShared];
  };

  struct Storage : OverflowCount {
    StackEntry* block;  ///< kEntriesPerThread * threads entries of shared memory.
    unsigned thread;    ///< This thread's number in its block.
    unsigned threads;   ///< Of the block.
    StackEntry* own;

    /// @param memory lives as long as the traversal.
    HIPRT_HD HIPRT_INLINE Storage(StackEntry* block_entries, unsigned block_thread, unsigned block_threads,
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

    HIPRT_HD HIPRT_INLINE explicit Of(const Storage& storage)
        : shared_(reinterpret_cast<Entry*>(storage.block) + storage.thread),
          threads_(storage.threads),
          own_(storage.own) {
      store_shared(shared_, 0, bottom_entry<Entry>());
    }
    HIPRT_HD HIPRT_INLINE bool has_room() const { return size_ + kMostPushed <= kEntries + 1; }
    HIPRT_HD HIPRT_INLINE void push(Entry entry) {
      if (size_ < kShared)
        store_shared(shared_, size_ * threads_, entry);
      else
        own_[size_ - kShared] = entry;
      ++size_;
    }
    /// One question for all entries of a node: mostly they find room in shared memory.
    template <class Each> HIPRT_HD HIPRT_INLINE void push_some(Each&& each) {
      if (size_ + kMostPushed <= kShared)
        each([&](Entry entry) HIPRT_INLINE_LAMBDA { store_shared(shared_, size_++ * threads_, entry); });
      else
        each([&](Entry entry) HIPRT_INLINE_LAMBDA { push(entry); });
    }
    HIPRT_HD HIPRT_INLINE Entry pop() {
      const unsigned top = size_ - 1;
      size_ = top > 1 ? top : 1;
      if (top < kShared) return load_shared(shared_, top * threads_);
      return static_cast<Entry>(own_[top - kShared]);
    }
    HIPRT_HD HIPRT_INLINE bool empty() const { return size_ == 1; }

   private:
    Entry* shared_;
    unsigned threads_;
    StackEntry* own_;
    unsigned size_ = 1;  ///< With the bottom.
  };
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
