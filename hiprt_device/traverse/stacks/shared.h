#pragma once
/// A stack in a block's shared memory (LDS). Entries are interleaved so that lanes have no bank conflicts.

#include <hiprt_device/math/memory.h>
#include <hiprt_device/traverse/stacks/stack.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// @tparam kEntries capacity. Trees that need more (FileHeader::stack_bound) may overflow it.
///
///     __shared__ hiprt::StackEntry entries[kBlock * hiprt::SharedStack<16>::kEntriesPerThread];
///     hiprt::SharedStack<16>::Storage storage(entries, threadIdx.x, kBlock);
template <unsigned kEntries = 16> struct SharedStack {
  static constexpr unsigned kEntriesPerThread = kEntries;

  struct Storage : OverflowCount {
    StackEntry* block;  ///< kEntriesPerThread * threads entries of shared memory.
    unsigned thread;    ///< This thread's number in its block.
    unsigned threads;   ///< Number of threads of the block.

    HIPRT_HD HIPRT_FORCE_INLINE Storage(StackEntry* block_entries, unsigned block_thread, unsigned block_threads,
                                        std::uint32_t* overflowed = nullptr)
        : OverflowCount{overflowed}, block(block_entries), thread(block_thread), threads(block_threads) {}
  };

  template <class Entry> class Of {
   public:
    HIPRT_HD HIPRT_FORCE_INLINE explicit Of(const Storage& storage)
        : entries_(reinterpret_cast<Entry*>(storage.block) + storage.thread), threads_(storage.threads) {}
    HIPRT_HD HIPRT_FORCE_INLINE bool has_room() const { return size_ + kMostPushed <= kEntries; }
    HIPRT_HD HIPRT_FORCE_INLINE void push(Entry entry) { store_shared(entries_, size_++ * threads_, entry); }
    HIPRT_HD HIPRT_FORCE_INLINE Entry pop() { return load_shared(entries_, --size_ * threads_); }
    HIPRT_HD HIPRT_FORCE_INLINE bool empty() const { return size_ == 0; }

   private:
    Entry* entries_;
    unsigned threads_;
    unsigned size_ = 0;
  };
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
