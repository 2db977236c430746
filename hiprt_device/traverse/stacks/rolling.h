#pragma once
/// The rolling stack of HIPRT (HPG 2024): a ring of the topmost entries in shared memory, the others in global memory.
/// And a stack with all entries in global memory.

#include <hiprt_device/math/memory.h>
#include <hiprt_device/traverse/stacks/spill.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// A ring of the topmost entries in shared memory, the others in global memory.
///
/// Most pushes and pops stay in shared memory. A full ring moves its oldest entry to global memory; an empty ring
/// reads from there. The tools use this stack on AMD GPUs. On other GPUs they use it for trees that are too large for
/// a PrivateStack. The default of Policies is a PrivateStack, which is faster on NVIDIA GPUs
/// (docs/decisions/0010-traversal-on-gpus.md).
/// @tparam kRing entries in shared memory; a power of two.
///
///     __shared__ hiprt::StackEntry ring[kBlock * hiprt::RollingStack<8>::kEntriesPerThread];
///     hiprt::RollingStack<8>::Storage storage(ring, threadIdx.x, kBlock, hiprt::grid_spill(memory, ...));
template <unsigned kRing = 8> struct RollingStack {
  static_assert(kRing != 0 && (kRing & (kRing - 1)) == 0, "hiprt: RollingStack: kRing must be a power of two");
  static constexpr unsigned kEntriesPerThread = kRing;

  /// Entries of global memory per thread for a scene.
  /// @param stack_bound SceneView::stack_bound.
  HIPRT_HD static constexpr std::uint32_t spill_entries(std::uint32_t stack_bound) {
    return stack_bound + kMostPushed > kRing ? stack_bound + kMostPushed - kRing : 0;
  }

  struct Storage : OverflowCount {
    StackEntry* block;  ///< kEntriesPerThread * threads entries of shared memory.
    unsigned thread;    ///< This thread's number in its block.
    unsigned threads;   ///< Number of threads of the block.
    Spill spill;

    HIPRT_HD HIPRT_FORCE_INLINE Storage(StackEntry* block_ring, unsigned block_thread, unsigned block_threads,
                                        const Spill& spill_memory, std::uint32_t* overflowed = nullptr)
        : OverflowCount{overflowed},
          block(block_ring),
          thread(block_thread),
          threads(block_threads),
          spill(spill_memory) {}
  };

  template <class Entry> class Of {
   public:
    HIPRT_HD HIPRT_FORCE_INLINE explicit Of(const Storage& storage)
        : ring_(reinterpret_cast<Entry*>(storage.block) + storage.thread),
          threads_(storage.threads),
          spill_(storage.spill) {}
    HIPRT_HD HIPRT_FORCE_INLINE bool has_room() const { return size_ + kMostPushed <= kRing + spill_.capacity; }
    HIPRT_HD HIPRT_FORCE_INLINE void push(Entry entry) {
      if (size_ - spilled_ == kRing) {
        store_spilled(spill_, spilled_, load_shared(ring_, slot(spilled_)));
        ++spilled_;
      }
      store_shared(ring_, slot(size_++), entry);
    }
    HIPRT_HD HIPRT_FORCE_INLINE Entry pop() {
      --size_;
      if (size_ >= spilled_) return load_shared(ring_, slot(size_));
      spilled_ = size_;
      return load_spilled<Entry>(spill_, size_);
    }
    HIPRT_HD HIPRT_FORCE_INLINE bool empty() const { return size_ == 0; }

   private:
    HIPRT_HD HIPRT_FORCE_INLINE unsigned slot(unsigned i) const { return (i & (kRing - 1)) * threads_; }

    Entry* ring_;
    unsigned threads_;
    Spill spill_;
    unsigned size_ = 0;
    unsigned spilled_ = 0;  ///< Entries [0, spilled_) are in global memory, the others in the ring.
  };
};

/// A stack with all entries in global memory.
///
/// With the slots of a SpillPool (WaveSlot) the memory does not grow with the grid. HIPRT calls that the dynamic
/// global stack.
struct GlobalStack {
  struct Storage : OverflowCount {
    Spill spill;

    HIPRT_HD HIPRT_FORCE_INLINE explicit Storage(const Spill& spill_memory, std::uint32_t* overflowed = nullptr)
        : OverflowCount{overflowed}, spill(spill_memory) {}
  };

  template <class Entry> class Of {
   public:
    HIPRT_HD HIPRT_FORCE_INLINE explicit Of(const Storage& storage) : spill_(storage.spill) {}
    HIPRT_HD HIPRT_FORCE_INLINE bool has_room() const { return size_ + kMostPushed <= spill_.capacity; }
    HIPRT_HD HIPRT_FORCE_INLINE void push(Entry entry) { store_spilled(spill_, size_++, entry); }
    HIPRT_HD HIPRT_FORCE_INLINE Entry pop() { return load_spilled<Entry>(spill_, --size_); }
    HIPRT_HD HIPRT_FORCE_INLINE bool empty() const { return size_ == 0; }

   private:
    Spill spill_;
    unsigned size_ = 0;
  };
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
