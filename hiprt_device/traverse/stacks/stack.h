#pragma once
/// What a traversal stack is, and how the traversal uses one. stacks/*.h has the stacks.

#include <hiprt_device/format/node.h>
#include <hiprt_device/math/atomic.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The bits of the entry distance above the node reference.
///
/// The distance is not negative, so its bits have its order. Sorting entries sorts by distance, then by reference.
/// Orders without distances push bare node references.
using StackEntry = std::uint64_t;

/// @param enter t where the ray enters the node's box: 0 or more, and not -0.
HIPRT_HD HIPRT_FORCE_INLINE StackEntry make_entry(float enter, NodeRef ref) {
  return static_cast<StackEntry>(std::bit_cast<std::uint32_t>(enter)) << 32 | ref;
}
/// The distance from which the entry was made.
HIPRT_HD HIPRT_FORCE_INLINE float entry_distance(StackEntry entry) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(entry >> 32));
}
HIPRT_HD HIPRT_FORCE_INLINE NodeRef entry_ref(StackEntry entry) { return static_cast<NodeRef>(entry); }
/// An entry without a distance is never too far.
HIPRT_HD HIPRT_FORCE_INLINE float entry_distance(NodeRef) { return 0.0f; }
HIPRT_HD HIPRT_FORCE_INLINE NodeRef entry_ref(NodeRef entry) { return entry; }

/// The next node of a traversal whose stack is too small. Its address is that of kInvalidRef, where no node can be.
inline constexpr NodeRef kOverflowRef = kInvalidRef - 1;
/// The root of a traversal that must not start. It has the same address.
inline constexpr NodeRef kRefusedRef = make_ref(kAddressLimit, NodeType::kTriangle3);
/// The stack entry below the nodes of an instance: the traversal leaves the instance there. It has the same address,
/// and is neither a box node nor a leaf.
inline constexpr NodeRef kExitRef = make_ref(kAddressLimit, NodeType::kTriangle2);
static_assert(!is_box(kExitRef) && !is_box(kRefusedRef) && !is_box(kOverflowRef));
static_assert(kExitRef < kRefusedRef && kRefusedRef < kOverflowRef);
/// Whether the reference is neither node nor leaf: kInvalidRef, kOverflowRef or kRefusedRef.
HIPRT_HD constexpr bool is_end(NodeRef ref) { return ref >= kRefusedRef; }

/// The entry that an empty stack with a bottom (kHasBottom) pops: the end, which is never too far. So pop() need not
/// check whether the stack is empty.
template <class Entry> HIPRT_HD HIPRT_FORCE_INLINE Entry bottom_entry() {
  if constexpr (std::same_as<Entry, NodeRef>)
    return kInvalidRef;
  else
    return make_entry(-std::numeric_limits<float>::infinity(), kInvalidRef);
}

/// The number of children that a node may push.
inline constexpr unsigned kMostPushed = kBranching - 1;

/// A stack of one kind of entry, StackEntry or NodeRef, as one ray uses it.
///
/// has_room() says whether kMostPushed more entries fit. The traversal calls it once per node, before push(). pop()
/// requires !empty(). If the stack says kHasBottom, an empty stack pops bottom_entry() any number of times. A stack
/// never overflows if its capacity is at least the scene's stack bound + kMostPushed.
template <class T, class Entry, class Storage>
concept StackOf = requires(T stack, const T& constant, Entry entry, const Storage& storage) {
  T(storage);
  stack.push(entry);
  { constant.has_room() } -> std::same_as<bool>;
  { stack.pop() } -> std::same_as<Entry>;
  { constant.empty() } -> std::same_as<bool>;
};

/// The part of a Storage that counts overflows for the host.
struct OverflowCount {
  /// Counts the rays whose stack was too small. nullptr: not counted. The memory must be readable by the host.
  std::uint32_t* overflowed_rays = nullptr;

  HIPRT_HD HIPRT_FORCE_INLINE void on_overflow() const {
    if (overflowed_rays != nullptr) fetch_add(overflowed_rays, 1);  // NOLINT: clang 14 misses the initialisation.
  }
};

/// A stack policy has two members, `Storage` and `Of<Entry>`.
///
/// `Storage` is a small value that says where the entries of one ray lie. `Of<Entry>` is constructed from it for every
/// ray. Storage::on_overflow(), if there is one, is called once per ray whose stack was too small.
template <class T>
concept PlainStack = StackOf < typename T::template Of<StackEntry>,
        StackEntry,
typename T::Storage > &&StackOf<typename T::template Of<NodeRef>, NodeRef, typename T::Storage>;

/// Backtracking: how a traversal comes back to children that it passed by. This class does it on a PlainStack.
///
/// - reserve(): false is an overflow, which ends the traversal.
/// - later() or later_some(): for the children to visit later, the farthest first.
/// - follow(): for the nearest child. It returns the node to visit next.
/// - pop(): when a branch is done. It returns the next node no farther than limit, or kInvalidRef at the end.
template <class Stack, class Entry> class StackBacktrack {
  static constexpr bool kHasUsual =
      requires(typename Stack::template Of<Entry> stack, const NodeRef (&child)[kBranching]) {
    stack.is_usual(0u);
    stack.next_usual(child, stack.top());
  };

 public:
  /// Whether children at the same distance must come in the same order at every visit of their node.
  static constexpr bool kNeedsStableOrder = false;

  HIPRT_HD HIPRT_FORCE_INLINE StackBacktrack(const typename Stack::Storage& storage, NodeRef) : stack_(storage) {}

  HIPRT_HD HIPRT_FORCE_INLINE bool reserve() const { return stack_.has_room(); }
  HIPRT_HD HIPRT_FORCE_INLINE bool empty() const { return stack_.empty(); }
  HIPRT_HD HIPRT_FORCE_INLINE void later(Entry entry) { stack_.push(entry); }
  /// Calls later() for each entry that @p each passes to its argument: at most kMostPushed entries. Stacks with a
  /// push_some() are called once for all of them.
  template <class Each> HIPRT_HD HIPRT_FORCE_INLINE void later_some(Each&& each) {
    if constexpr (requires { stack_.push_some(each); })
      stack_.push_some(each);
    else
      each([&](Entry entry) HIPRT_FORCE_INLINE_LAMBDA { stack_.push(entry); });
  }
  /// The step behind a node whose children are sorted. kInvalidRef: no child.
  /// @return the first child, and the others are left for later; what pop(limit) returns, if there is none; or
  /// kOverflowRef.
  HIPRT_HD HIPRT_FORCE_INLINE NodeRef next_sorted(const NodeRef (&child)[kBranching], float limit) {
    if (child[0] == kInvalidRef) return pop(limit);
    if (!reserve()) return kOverflowRef;
    for (unsigned i = kBranching - 1; i > 0; --i)
      if (child[i] != kInvalidRef) later(child[i]);
    return follow(child[0]);
  }
  /// Whether next_usual() may replace next_sorted(): it takes fewer instructions, and needs room in shared memory.
  /// @param rare 0; all bits: never
  HIPRT_HD HIPRT_FORCE_INLINE bool is_usual(std::uint32_t rare) const requires(kHasUsual) {
    return stack_.is_usual(rare);
  }
  /// The entry that pop() would return. Loaded before the boxes are tested, it costs no waiting.
  HIPRT_HD HIPRT_FORCE_INLINE NodeRef top() const requires(kHasUsual) { return stack_.top(); }
  /// @param top that of top(). @pre is_usual()
  HIPRT_HD HIPRT_FORCE_INLINE NodeRef next_usual(const NodeRef (&child)[kBranching], NodeRef top) requires(kHasUsual) {
    return stack_.next_usual(child, top);
  }
  HIPRT_HD HIPRT_FORCE_INLINE NodeRef follow(Entry entry) { return entry_ref(entry); }
  HIPRT_HD HIPRT_FORCE_INLINE NodeRef pop(float limit) {
    // The bottom is not too far, whatever the limit.
    while (kHasBottom || !stack_.empty()) {
      const Entry entry = stack_.pop();
      if (kHasBottom ? kNoDistances || !(entry_distance(entry) > limit) : entry_distance(entry) <= limit)
        return entry_ref(entry);
    }
    return kInvalidRef;
  }

  /// What continue_at() needs, if nothing writes to the stack's memory in between. For a stack with size() and resize()
  /// this is the number of entries, else a copy of the stack object.
  HIPRT_HD HIPRT_FORCE_INLINE auto mark() const {
    if constexpr (requires { stack_.size(); })
      return stack_.size();
    else
      return stack_;
  }
  template <class Mark> HIPRT_HD HIPRT_FORCE_INLINE void continue_at(const Mark& mark) {
    if constexpr (requires { stack_.resize(mark); })
      stack_.resize(mark);
    else
      stack_ = mark;
  }

 private:
  static constexpr bool kHasBottom = requires { Stack::template Of<Entry>::kHasBottom; };
  static constexpr bool kNoDistances = std::same_as<Entry, NodeRef>;
  typename Stack::template Of<Entry> stack_;
};

namespace stack_detail {
/// An argument of later_some(), for the concept.
struct NoEntries {
  template <class Later> HIPRT_HD void operator()(Later&&) const {}
};
}  // namespace stack_detail

/// A stack policy with a backtracking class of its own (stacks/restart.h).
template <class T>
concept BacktrackingStack = requires(typename T::template Backtrack<StackEntry> backtrack, StackEntry entry,
                                     float limit) {
  requires std::constructible_from < typename T::template Backtrack<StackEntry>,
  const typename T::Storage&, NodeRef > ;
  { backtrack.reserve() } -> std::same_as<bool>;
  backtrack.later(entry);
  backtrack.later_some(stack_detail::NoEntries{});
  { backtrack.follow(entry) } -> std::same_as<NodeRef>;
  { backtrack.pop(limit) } -> std::same_as<NodeRef>;
  { T::template Backtrack<StackEntry>::kNeedsStableOrder } -> std::convertible_to<bool>;
};

/// The requirement of Policies::Stack.
template <class T>
concept TraversalStack = PlainStack<T> || BacktrackingStack<T>;

namespace stack_detail {

template <class Stack, class Entry> struct BacktrackOf { using Type = StackBacktrack<Stack, Entry>; };
template <BacktrackingStack Stack, class Entry> struct BacktrackOf<Stack, Entry> {
  using Type = typename Stack::template Backtrack<Entry>;
};

}  // namespace stack_detail

/// @tparam Entry StackEntry or NodeRef.
template <TraversalStack Stack, class Entry> using BacktrackOf = typename stack_detail::BacktrackOf<Stack, Entry>::Type;

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
