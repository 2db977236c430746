#pragma once
/// Stack in the thread's own memory: the processor's stack on a host, scratch or local memory on a GPU.

#include <hiprt_device/stack.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// @tparam kEntries capacity. The builders' trees never need more than 180 (FileHeader::stack_bound says how many).
template <unsigned kEntries = 192> struct PrivateStack {
  /// The entries lie in the stack itself.
  struct Storage : OverflowCount {};

  template <class Entry> class Of {
   public:
    HIPRT_HD HIPRT_INLINE explicit Of(const Storage&) {}
    HIPRT_HD HIPRT_INLINE bool push(Entry entry) {
      if (size_ == kEntries) return false;
      entries_[size_++] = entry;
      return true;
    }
    HIPRT_HD HIPRT_INLINE Entry pop() { return entries_[--size_]; }
    HIPRT_HD HIPRT_INLINE bool empty() const { return size_ == 0; }

   private:
    Entry entries_[kEntries];
    unsigned size_ = 0;
  };
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
