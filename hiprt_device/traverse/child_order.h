#pragma once
/// Orders: policies that decide in which order a ray visits the children that it meets. An order returns the next node
/// and pushes the others (stack.h).

#include <hiprt_device/intersect/box_test.h>
#include <hiprt_device/intersect/candidate.h>
#include <hiprt_device/math/arithmetic.h>
#include <hiprt_device/traverse/stacks/stack.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace order_detail {

inline constexpr float kMissed = std::numeric_limits<float>::infinity();

struct Child {
  float enter;  ///< t where the ray enters the box; kMissed if it does not meet the box.
  NodeRef ref;

  HIPRT_HD HIPRT_FORCE_INLINE bool counts() const { return enter < kMissed; }
};

template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE Child child_of(const NodeRef (&child)[kBranching], const BoxHits<Lanes>& hits, unsigned i) {
  return Child{hits.hit(i) ? Lanes::get(hits.enter, i) : kMissed, child[i]};
}

template <class Backtrack> HIPRT_HD HIPRT_FORCE_INLINE void sort(Child& a, Child& b) {
  bool swap = b.enter < a.enter;
  if constexpr (Backtrack::kNeedsStableOrder) swap = swap || (b.enter == a.enter && b.ref < a.ref);
  const Child low{swap ? b.enter : a.enter, swap ? b.ref : a.ref};
  b = Child{swap ? a.enter : b.enter, swap ? a.ref : b.ref};
  a = low;
}

// Functors, because NVRTC treats generic lambdas as host code.

/// A child by the bits of its distance, which have the order of distances that are not negative.
struct Key {
  std::int32_t bits;
  NodeRef ref;
};
/// The bits of a child that is not met: above all numbers, and a NaN, which is within no limit.
inline constexpr std::int32_t kMissedBits = 0x7fffffff;

HIPRT_HD HIPRT_FORCE_INLINE void sort(Key& a, Key& b) {
  const bool swap = b.bits < a.bits;
  const Key low{swap ? b.bits : a.bits, swap ? b.ref : a.ref};
  b = Key{swap ? a.bits : b.bits, swap ? a.ref : b.ref};
  a = low;
}

/// The child of a key. It counts if the ray enters it at the limit or before.
struct ChildWithin {
  float enter;
  NodeRef ref;
  float limit;

  HIPRT_HD HIPRT_FORCE_INLINE ChildWithin(const Key& key, float last)
      : enter(std::bit_cast<float>(key.bits)), ref(key.ref), limit(last) {}
  HIPRT_HD HIPRT_FORCE_INLINE bool counts() const { return enter <= limit; }
};

/// All children that count except the nearest, as an argument of later_some().
template <class Child> struct EachLater {
  Child farthest, middle, nearer;

  /// Calls later(entry), the farthest first.
  template <class Later> HIPRT_HD HIPRT_FORCE_INLINE void operator()(Later&& later) const {
    if (farthest.counts()) later(make_entry(farthest.enter, farthest.ref));
    if (middle.counts()) later(make_entry(middle.enter, middle.ref));
    if (nearer.counts()) later(make_entry(nearer.enter, nearer.ref));
  }
};

/// The same of children that are sorted, so that those which do not count are the farthest.
template <class Child> struct EachSorted : EachLater<Child> {
  using EachLater<Child>::farthest, EachLater<Child>::middle, EachLater<Child>::nearer;

  HIPRT_HD HIPRT_FORCE_INLINE unsigned count() const {
    return (farthest.counts() ? 1u : 0u) + (middle.counts() ? 1u : 0u) + (nearer.counts() ? 1u : 0u);
  }
  /// Calls put(place, entry) with the places -1, -2 and -3, relative to the end of the stack when all are pushed.
  template <class Put> HIPRT_HD HIPRT_FORCE_INLINE void put_below_end(Put&& put) const {
    if (nearer.counts()) put(-1, make_entry(nearer.enter, nearer.ref));
    if (middle.counts()) put(-2, make_entry(middle.enter, middle.ref));
    if (farthest.counts()) put(-3, make_entry(farthest.enter, farthest.ref));
  }
};

/// All met children except the first, as an argument of later_some().
struct EachMet {
  const NodeRef (&child)[kBranching];
  const bool (&is_later)[kBranching];

  /// Calls later(reference), the last first.
  template <class Later> HIPRT_HD HIPRT_FORCE_INLINE void operator()(Later&& later) const {
    if (is_later[3]) later(child[3]);
    if (is_later[2]) later(child[2]);
    if (is_later[1]) later(child[1]);
  }
};

}  // namespace order_detail

/// Visits the nearest child first and pushes the others, the farthest first. For closest hits.
struct NearFirst {
  using Entry = StackEntry;

  /// @pre hits.any()
  template <class Lanes, class Backtrack>
  HIPRT_HD static HIPRT_FORCE_INLINE NodeRef next(const NodeRef (&child)[kBranching], const BoxHits<Lanes>& hits,
                                                  Backtrack& backtrack) {
    if (!backtrack.reserve()) return kOverflowRef;
    if constexpr (Lanes::kScalar)
      return next_by_network(child, hits, backtrack);
    else
      return next_by_count(child, hits, backtrack);
  }

  /// The same for a box test by bits, which has not compared distances with the limit. Here that takes fewer
  /// comparisons: only those of the children that are pushed.
  /// @param node that of the children. @param hits of any distance.
  /// @return what backtrack.pop(limit) does, if no child is met up to the limit.
  template <class Lanes, class Node, class Backtrack>
  HIPRT_HD static HIPRT_FORCE_INLINE NodeRef next_within(const Node& node, const BoxHits<Lanes>& hits, float limit,
                                                         Backtrack& backtrack) {
    using namespace order_detail;
    const auto bits = [&](unsigned i) HIPRT_FORCE_INLINE_LAMBDA {
      return hits.hit(i) ? std::bit_cast<std::int32_t>(Lanes::get(hits.enter, i)) : kMissedBits;
    };
    const std::int32_t bits0 = bits(0), bits1 = bits(1), bits2 = bits(2), bits3 = bits(3);
    const bool swap_even = bits2 < bits0, swap_odd = bits3 < bits1;
    Key a{swap_even ? bits2 : bits0, kInvalidRef}, c{swap_even ? bits0 : bits2, kInvalidRef};
    Key b{swap_odd ? bits3 : bits1, kInvalidRef}, d{swap_odd ? bits1 : bits3, kInvalidRef};
    const bool even = ChildWithin(a, limit).counts(), odd = ChildWithin(b, limit).counts();
    if (!(even | odd)) return backtrack.pop(limit);
    if (!backtrack.reserve()) return kOverflowRef;
    // Loaded only if a child is met.
    const Words child = load_words(node.child);
    a.ref = swap_even ? child.word[2] : child.word[0];
    c.ref = swap_even ? child.word[0] : child.word[2];
    b.ref = swap_odd ? child.word[3] : child.word[1];
    d.ref = swap_odd ? child.word[1] : child.word[3];
    order_detail::sort(a, b);
    order_detail::sort(c, d);
    order_detail::sort(b, c);
    using Within = ChildWithin;
    backtrack.later_some(EachSorted<Within>{{Within(d, limit), Within(c, limit), Within(b, limit)}});
    return backtrack.follow(make_entry(std::bit_cast<float>(a.bits), a.ref));
  }

  HIPRT_HD static HIPRT_FORCE_INLINE unsigned take(std::uint32_t& mask) {
    const unsigned lowest = lowest_bit(mask);
    mask &= mask - 1;
    return lowest;
  }

 private:
  /// Makes only as many comparisons as there are hits: mostly one or two.
  template <class Lanes, class Backtrack>
  HIPRT_HD static HIPRT_FORCE_INLINE NodeRef next_by_count(const NodeRef (&child)[kBranching],
                                                           const BoxHits<Lanes>& hits, Backtrack& backtrack) {
    std::uint32_t mask = hits.mask;
    alignas(16) float enter[kBranching];
    Lanes::store(enter, hits.enter);
    const unsigned first = take(mask);
    // Before an entry is made: the next visit waits for the reference.
    if (mask == 0) return backtrack.follow(make_entry(enter[first], child[first]));
    const auto take_entry = [&] {
      const unsigned i = take(mask);
      return make_entry(enter[i], child[i]);
    };
    StackEntry a = make_entry(enter[first], child[first]);
    StackEntry b = take_entry();
    sort(a, b);
    if (mask != 0) {
      StackEntry c = take_entry();
      sort(b, c);
      sort(a, b);
      if (mask != 0) {
        StackEntry d = take_entry();
        sort(c, d);
        sort(b, c);
        sort(a, b);
        backtrack.later(d);
      }
      backtrack.later(c);
    }
    backtrack.later(b);
    return backtrack.follow(a);
  }

  HIPRT_HD static HIPRT_FORCE_INLINE void sort(StackEntry& a, StackEntry& b) {
    const StackEntry low = a < b ? a : b, high = a < b ? b : a;
    a = low;
    b = high;
  }

  /// Sorts with five compare-exchanges whatever the number of hits: only the pushes branch.
  template <class Lanes, class Backtrack>
  HIPRT_HD static HIPRT_FORCE_INLINE NodeRef next_by_network(const NodeRef (&child)[kBranching],
                                                             const BoxHits<Lanes>& hits, Backtrack& backtrack) {
    using namespace order_detail;
    Child a = child_of(child, hits, 0), b = child_of(child, hits, 1), c = child_of(child, hits, 2),
          d = child_of(child, hits, 3);
    order_detail::sort<Backtrack>(a, c);
    order_detail::sort<Backtrack>(b, d);
    order_detail::sort<Backtrack>(a, b);
    order_detail::sort<Backtrack>(c, d);
    order_detail::sort<Backtrack>(b, c);
    backtrack.later_some(EachSorted<Child>{{d, c, b}});
    return backtrack.follow(make_entry(a.enter, a.ref));
  }
};

/// Whether an order has next_within().
template <class Order> inline constexpr bool kComparesLimitOf = false;
template <> inline constexpr bool kComparesLimitOf<NearFirst> = true;

/// Visits the nearest child first and pushes the others in stored order: three compare-exchanges.
struct NearestFirst {
  using Entry = StackEntry;

  /// @pre hits.any()
  template <class Lanes, class Backtrack>
  HIPRT_HD static HIPRT_FORCE_INLINE NodeRef next(const NodeRef (&child)[kBranching], const BoxHits<Lanes>& hits,
                                                  Backtrack& backtrack) {
    static_assert(!Backtrack::kNeedsStableOrder,
                  "hiprt: NearestFirst: a restart trail needs children in the order of distance");
    if (!backtrack.reserve()) return kOverflowRef;
    using namespace order_detail;
    Child a = child_of(child, hits, 0), b = child_of(child, hits, 1), c = child_of(child, hits, 2),
          d = child_of(child, hits, 3);
    order_detail::sort<Backtrack>(a, b);
    order_detail::sort<Backtrack>(c, d);
    order_detail::sort<Backtrack>(a, c);
    backtrack.later_some(EachLater<Child>{d, c, b});
    return backtrack.follow(make_entry(a.enter, a.ref));
  }
};

/// Visits children in stored order. For any hit, where the first hit ends the search whatever its distance.
struct Unordered {
  using Entry = NodeRef;

  /// @pre hits.any()
  template <class Lanes, class Backtrack>
  HIPRT_HD static HIPRT_FORCE_INLINE NodeRef next(const NodeRef (&child)[kBranching], const BoxHits<Lanes>& hits,
                                                  Backtrack& backtrack) {
    if (!backtrack.reserve()) return kOverflowRef;
    if constexpr (Lanes::kScalar) {
      const bool first = hits.hit(0), first_two = first | hits.hit(1), first_three = first_two | hits.hit(2);
      const bool is_later[kBranching] = {false, first && hits.hit(1), first_two && hits.hit(2),
                                         first_three && hits.hit(3)};
      backtrack.later_some(order_detail::EachMet{child, is_later});
      const NodeRef of_two = choose(first, child[0], child[1]), of_others = choose(hits.hit(2), child[2], child[3]);
      return backtrack.follow(choose(first_two, of_two, of_others));
    } else {
      std::uint32_t mask = hits.mask;
      const unsigned first = NearFirst::take(mask);
      while (mask != 0) backtrack.later(child[take_last(mask)]);
      return backtrack.follow(child[first]);
    }
  }

 private:
  HIPRT_HD static HIPRT_FORCE_INLINE unsigned take_last(std::uint32_t& mask) {
    const unsigned highest = static_cast<unsigned>(std::bit_width(mask)) - 1;
    mask ^= 1u << highest;
    return highest;
  }
};

/// Visits children as a box test that sorts (SortingBoxTest) has left them. Their distances are not known.
struct AsTested {
  using Entry = NodeRef;

  /// @param limit of pop(), if no child is met.
  template <class Backtrack>
  HIPRT_HD static HIPRT_FORCE_INLINE NodeRef next(const SortedChildren& sorted, Backtrack& backtrack, float limit) {
    static_assert(!Backtrack::kNeedsStableOrder, "hiprt: AsTested: a restart trail needs children in a known order");
    return backtrack.next_sorted(sorted.child, limit);
  }
};

/// An order says what it pushes: entries with a distance, or bare node references.
template <class T>
concept LeavesEntries = std::same_as<typename T::Entry, StackEntry> || std::same_as<typename T::Entry, NodeRef>;

/// An order that compares the distances of a box test.
///
/// next() returns the node to visit next, below a node with at least one met child. It returns
/// kOverflowRef if the stack has no room for the other children.
template <class T, class Stack, class Lanes>
concept DistanceOrder = LeavesEntries<T> && requires(const NodeRef (&child)[kBranching], const BoxHits<Lanes>& hits,
                                                     BacktrackOf<Stack, typename T::Entry>& backtrack) {
  { T::next(child, hits, backtrack) } -> std::same_as<NodeRef>;
};

/// An order of children that the box test has sorted. next() is like that of a DistanceOrder. If no child is met it
/// returns what backtrack.pop(limit) does.
template <class T, class Stack>
concept SortedOrder = LeavesEntries<T> &&
    requires(const SortedChildren& sorted, BacktrackOf<Stack, typename T::Entry>& backtrack, float limit) {
  { T::next(sorted, backtrack, limit) } -> std::same_as<NodeRef>;
};

/// The requirement of Policies::ClosestOrder and Policies::AnyOrder.
template <class T, class Stack, class Lanes>
concept TraversalOrder = DistanceOrder<T, Stack, Lanes> || SortedOrder<T, Stack>;

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
