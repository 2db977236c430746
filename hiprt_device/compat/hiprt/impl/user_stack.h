#pragma once
/// A program's own stack as a stack of this library. Internal.

#include <hiprt/impl/stacks.h>
#include <hiprt_device/traverse/child_order.h>

namespace hiprt::compat_detail {
inline namespace HIPRT_ISA_NAMESPACE {

/// The stack policy of a class with pop(), push(), empty(), vacancy() and reset().
template <class Stack> struct UserStack {
  struct Storage {
    Stack* entries;
  };

  template <class Entry> class Of {
   public:
    HIPRT_HD HIPRT_FORCE_INLINE explicit Of(const Storage& storage) : stack_(storage.entries) {}
    HIPRT_HD HIPRT_FORCE_INLINE bool has_room() const { return stack_->vacancy() >= kMostPushed * kWords; }
    HIPRT_HD HIPRT_FORCE_INLINE void push(Entry entry) {
      stack_->push(static_cast<std::uint32_t>(entry));
      if constexpr (kWords == 2) stack_->push(static_cast<std::uint32_t>(entry >> 32));
    }
    HIPRT_HD HIPRT_FORCE_INLINE Entry pop() {
      const auto last = static_cast<std::uint32_t>(stack_->pop());
      if constexpr (kWords == 2) return static_cast<Entry>(last) << 32 | static_cast<std::uint32_t>(stack_->pop());
      return last;
    }
    HIPRT_HD HIPRT_FORCE_INLINE bool empty() const { return stack_->empty(); }

   private:
    /// Entries of the program's stack per entry.
    static constexpr unsigned kWords = sizeof(Entry) / sizeof(std::uint32_t);  // NOLINT(bugprone-sizeof-expression)
    Stack* stack_;
  };
};

/// NearFirst, but what it pushes has no distance.
struct NearFirstReferences {
  using Entry = NodeRef;

  /// @pre hits.any()
  template <class Lanes, class Backtrack>
  HIPRT_HD static HIPRT_FORCE_INLINE NodeRef next(const NodeRef (&child)[kBranching], const BoxHits<Lanes>& hits,
                                                  Backtrack& backtrack) {
    WithoutDistances<Backtrack> references{backtrack};
    return NearFirst::next(child, hits, references);
  }

 private:
  template <class Backtrack> struct WithoutDistances {
    static constexpr bool kNeedsStableOrder = Backtrack::kNeedsStableOrder;
    Backtrack& backtrack;

    HIPRT_HD HIPRT_FORCE_INLINE bool reserve() const { return backtrack.reserve(); }
    HIPRT_HD HIPRT_FORCE_INLINE void later(StackEntry entry) { backtrack.later(entry_ref(entry)); }
    template <class Each> HIPRT_HD HIPRT_FORCE_INLINE void later_some(Each&& each) {
      each([&](StackEntry entry) HIPRT_FORCE_INLINE_LAMBDA { later(entry); });
    }
    HIPRT_HD HIPRT_FORCE_INLINE NodeRef follow(StackEntry entry) { return backtrack.follow(entry_ref(entry)); }
  };
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::compat_detail
