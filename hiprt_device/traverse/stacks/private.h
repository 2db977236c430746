#pragma once
/// A stack in the thread's own memory: the processor's stack on a host, scratch or local memory on a GPU.

#include <hiprt_device/traverse/stacks/stack.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// A stack in the thread's own memory.
/// @tparam kEntries capacity. The builders' trees never need more than 180 + kMostPushed (FileHeader::stack_bound).
///
///     hiprt::PrivateStack<>::Memory memory;
///     hiprt::ClosestHit<> query(scene, ray, memory);
///
/// The entries are a separate variable because their indices vary. As members of the traversal they would keep all of
/// it out of registers.
template <unsigned kEntries = 192> struct PrivateStack {
  struct Memory {
    /// StackEntry or NodeRef side by side. The bottom entry is the first.
    alignas(StackEntry) std::byte entries[(kEntries + 1) * sizeof(StackEntry)];
  };

  struct Storage : OverflowCount {
    std::byte* entries;

    /// @param memory must live as long as the traversal.
    HIPRT_HD HIPRT_FORCE_INLINE Storage(Memory& memory, std::uint32_t* overflowed = nullptr)
        : OverflowCount{overflowed}, entries(memory.entries) {}
  };

  template <class Entry> class Of {
   public:
    static constexpr bool kHasBottom = true;

    HIPRT_HD HIPRT_FORCE_INLINE explicit Of(const Storage& storage)
        : entries_(reinterpret_cast<Entry*>(storage.entries)) {
      entries_[0] = bottom_entry<Entry>();
    }
    HIPRT_HD HIPRT_FORCE_INLINE bool has_room() const { return size_ <= kEntries + 1 - kMostPushed; }
    HIPRT_HD HIPRT_FORCE_INLINE void push(Entry entry) { entries_[size_++] = entry; }
#if !(HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__))
    /// Computes one address for all entries of a node. On AMD this takes registers and saves nothing.
    template <class Each> HIPRT_HD HIPRT_FORCE_INLINE void push_some(Each&& each) requires requires { each.count(); }
    {
      size_ += each.count();
      Entry* const end = entries_ + size_;
      each.put_below_end([&](int place, Entry entry) HIPRT_FORCE_INLINE_LAMBDA { end[place] = entry; });
    }
#endif
    HIPRT_HD HIPRT_FORCE_INLINE Entry pop() {
      const unsigned top = size_ - 1;
      size_ = top > 1 ? top : 1;
      return entries_[top];
    }
    HIPRT_HD HIPRT_FORCE_INLINE bool empty() const { return size_ == 1; }
    /// See StackBacktrack::mark().
    HIPRT_HD HIPRT_FORCE_INLINE unsigned size() const { return size_; }
    HIPRT_HD HIPRT_FORCE_INLINE void resize(unsigned size) { size_ = size; }

   private:
    Entry* entries_;
    unsigned size_ = 1;  ///< Includes the bottom entry.
  };
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
