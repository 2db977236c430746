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

struct Child {
  float enter;  ///< t where the ray enters the box; kMissed if it does not meet the box.
  NodeRef ref;
};

inline constexpr float kMissed = std::numeric_limits<float>::infinity();

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

/// All met children except the nearest, as an argument of later_some().
struct EachLater {
  const Child &farthest, &middle, &nearer;

  /// Calls later(entry), the farthest first.
  template <class Later> HIPRT_HD HIPRT_FORCE_INLINE void operator()(Later&& later) const {
    if (farthest.enter < kMissed) later(make_entry(farthest.enter, farthest.ref));
    if (middle.enter < kMissed) later(make_entry(middle.enter, middle.ref));
    if (nearer.enter < kMissed) later(make_entry(nearer.enter, nearer.ref));
  }
};

/// The same of children that are sorted, so that missed ones are the farthest.
struct EachSorted : EachLater {
  HIPRT_HD HIPRT_FORCE_INLINE unsigned count() const {
    return (farthest.enter < kMissed ? 1u : 0u) + (middle.enter < kMissed ? 1u : 0u) +
           (nearer.enter < kMissed ? 1u : 0u);
  }
  /// Calls put(place, entry) with the places -1, -2 and -3, relative to the end of the stack when all are pushed.
  template <class Put> HIPRT_HD HIPRT_FORCE_INLINE void put_below_end(Put&& put) const {
    if (nearer.enter < kMissed) put(-1, make_entry(nearer.enter, nearer.ref));
    if (middle.enter < kMissed) put(-2, make_entry(middle.enter, middle.ref));
    if (farthest.enter < kMissed) put(-3, make_entry(farthest.enter, farthest.ref));
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
    backtrack.later_some(EachSorted{{d, c, b}});
    return backtrack.follow(make_entry(a.enter, a.ref));
  }
};

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
    backtrack.later_some(EachLater{d, c, b});
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
