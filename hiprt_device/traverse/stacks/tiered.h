#pragma once
/// A stack whose first entries are in a block's shared memory (LDS) and whose other entries are in the thread's own
/// memory.

#include <hiprt_device/intersect/candidate.h>
#include <hiprt_device/math/memory.h>
#include <hiprt_device/math/wave.h>
#include <hiprt_device/traverse/stacks/stack.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// A stack for divergent rays on NVIDIA GPUs.
///
/// NVIDIA's local memory puts the same word of all lanes side by side. Lanes whose stacks differ in size use four
/// bytes of every 32-byte sector that they move, and the stacks fill the L1 cache. In scenes of many instances this
/// stack is faster than a PrivateStack; with coherent rays it is slower. docs/decisions/0010-traversal-on-gpus.md has
/// the numbers. For AMD GPUs docs/PERFORMANCE_AMD.md has counts.
/// @tparam kShared entries in shared memory: those at the bottom of the stack. Twice as many fit where the order keeps
///         bare node references.
/// @tparam kEntries capacity.
///
///     __shared__ hiprt::StackEntry entries[kBlock * hiprt::TieredStack<16>::kEntriesPerThread];
///     hiprt::TieredStack<16>::Memory memory;
///     hiprt::TieredStack<16>::Storage storage(entries, threadIdx.x, kBlock, memory);
template <unsigned kShared = 16, unsigned kEntries = 192> struct TieredStack {
  static_assert(kShared >= 1 && kShared < kEntries, "hiprt: TieredStack: kShared must be from 1 to kEntries - 1");
  static constexpr unsigned kEntriesPerThread = kShared;

  struct Memory {
    alignas(StackEntry) std::byte entries[(kEntries + 1 - kShared) * sizeof(StackEntry)];
  };

  struct Storage : OverflowCount {
    StackEntry* block;  ///< kEntriesPerThread * threads entries of shared memory.
    unsigned thread;    ///< This thread's number in its block.
    unsigned threads;   ///< Number of threads of the block.
    std::byte* own;

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
    static_assert(sizeof(StackEntry) == 2 * sizeof(NodeRef));
    static constexpr unsigned kInShared = std::same_as<Entry, NodeRef> ? 2 * kShared : kShared;

   public:
    static constexpr bool kHasBottom = true;

    HIPRT_HD HIPRT_FORCE_INLINE explicit Of(const Storage& storage)
        : shared_(reinterpret_cast<Entry*>(storage.block) + storage.thread),
          threads_(storage.threads),
          own_(reinterpret_cast<Entry*>(storage.own)) {
      store_shared(shared_, 0, bottom_entry<Entry>());
    }
    HIPRT_HD HIPRT_FORCE_INLINE bool has_room() const { return top_ + kMostPushed <= kEntries; }
    HIPRT_HD HIPRT_FORCE_INLINE void push(Entry entry) {
      ++top_;
      if (top_ < kInShared)
        store_shared(shared_, top_ * threads_, entry);
      else
        own_[top_ - kInShared] = entry;
    }
    /// Checks once for all entries of a node: mostly they fit in shared memory.
    template <class Each> HIPRT_HD HIPRT_FORCE_INLINE void push_some(Each&& each) {
      if (top_ + kMostPushed < kInShared)
        each([&](Entry entry) HIPRT_FORCE_INLINE_LAMBDA { store_shared(shared_, ++top_ * threads_, entry); });
      else
        each([&](Entry entry) HIPRT_FORCE_INLINE_LAMBDA { push(entry); });
    }
    HIPRT_HD HIPRT_FORCE_INLINE Entry pop() {
      const unsigned top = top_;
      top_ = top > 1 ? top - 1 : 0;
      if constexpr (kReadsSharedAlways) {
        Entry entry = load_shared(shared_, (top < kInShared ? top : kInShared - 1) * threads_);
        if (top >= kInShared) [[unlikely]]
          entry = own_[top - kInShared];
        return entry;
      } else {
        if (top < kInShared) return load_shared(shared_, top * threads_);
        return own_[top - kInShared];
      }
    }
    HIPRT_HD HIPRT_FORCE_INLINE bool empty() const { return top_ == 0; }

    // See StackBacktrack::is_usual(). All entries are in shared memory, and on AMD no lane branches by itself.

    HIPRT_HD HIPRT_FORCE_INLINE bool is_usual(std::uint32_t rare) const requires std::same_as<Entry, NodeRef> {
      return (top_ | rare) < kUsual;
    }
    HIPRT_HD HIPRT_FORCE_INLINE NodeRef top() const requires std::same_as<Entry, NodeRef> {
      return load_shared(shared_, top_ * threads_);
    }
    HIPRT_HD HIPRT_FORCE_INLINE NodeRef next_usual(const NodeRef (&child)[kBranching],
                                                   NodeRef top) requires std::same_as<Entry, NodeRef> {
      const bool pops = child[0] == kInvalidRef;
      const unsigned popped = pops ? 1 : 0;
      top_ = top_ > popped ? top_ - popped : 0;
      if (needed_by_a_lane(child[1] != kInvalidRef))
        for (unsigned i = kBranching - 1; i > 0; --i) {
          store_shared(shared_ + threads_, top_ * threads_, child[i]);
          top_ += child[i] != kInvalidRef ? 1 : 0;
        }
      return choose(pops, top, child[0]);
    }

   private:
    /// On AMD a branch costs more instructions than a load from shared memory.
#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__)
    static constexpr bool kReadsSharedAlways = true;
#else
    static constexpr bool kReadsSharedAlways = false;
#endif

    /// All children of a node fit in shared memory if the top is below this number.
    static constexpr unsigned kUsual = kInShared > kMostPushed ? kInShared - kMostPushed : 0;

    Entry* shared_;
    unsigned threads_;
    Entry* own_;
    unsigned top_ = 0;  ///< The number of the entry on top. 0 is the bottom.
  };
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
