#pragma once
/// Traversal stacks: a policy with kCapacity, push, pop and empty, made anew for every ray from its Storage, a small
/// value that says where the entries lie. Entries are 64 bits: entry distance and reference.

#include <hiprt_device/format/node.h>

#include <bit>
#include <concepts>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Bits of the entry distance (not negative, so its bits order as it does) above the node reference: sorting entries
/// sorts by distance, ties by reference.
using StackEntry = std::uint64_t;

HIPRT_HD HIPRT_INLINE StackEntry make_entry(float enter, NodeRef ref) {
  return static_cast<StackEntry>(std::bit_cast<std::uint32_t>(enter)) << 32 | ref;
}
HIPRT_HD HIPRT_INLINE float entry_distance(StackEntry entry) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(entry >> 32));
}
HIPRT_HD HIPRT_INLINE NodeRef entry_ref(StackEntry entry) { return static_cast<NodeRef>(entry); }

template <class T>
concept TraversalStack = requires(T stack, StackEntry entry, const typename T::Storage& storage) {
  T(storage);
  { T::kCapacity } -> std::convertible_to<unsigned>;
  stack.push(entry);
  { stack.pop() } -> std::same_as<StackEntry>;
  { stack.empty() } -> std::same_as<bool>;
};

/// A stack in the thread's own memory. The traversal compares the scene's stack bound with the capacity before it
/// starts, so push needs no check.
template <unsigned Capacity = 192> class PrivateStack {
 public:
  static constexpr unsigned kCapacity = Capacity;
  /// The entries lie in the stack itself.
  struct Storage {};

  HIPRT_HD HIPRT_INLINE explicit PrivateStack(const Storage&) {}

  HIPRT_HD HIPRT_INLINE void push(StackEntry entry) {
    HIPRT_ASSERT(size_ < Capacity);
    entries_[size_++] = entry;
  }
  /// @pre !empty()
  HIPRT_HD HIPRT_INLINE StackEntry pop() { return entries_[--size_]; }
  HIPRT_HD HIPRT_INLINE bool empty() const { return size_ == 0; }

 private:
  StackEntry entries_[Capacity];
  unsigned size_ = 0;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
