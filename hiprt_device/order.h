#pragma once
/// In which order the children that a ray meets are visited: a policy that picks the next node and leaves the others to
/// the way back (stack.h).

#include <hiprt_device/box_test.h>
#include <hiprt_device/stack.h>

#include <bit>
#include <limits>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Nearest child first, the others so that the nearer comes back earlier. For closest hits.
struct NearFirst {
  using Entry = StackEntry;

  /// @pre hits.any()
  template <class Lanes, class Way>
  HIPRT_HD static HIPRT_INLINE NodeRef next(const NodeRef (&child)[kBranching], const BoxHits<Lanes>& hits, Way& way) {
    if (!way.make_room()) return kInvalidRef;
    if constexpr (Lanes::kScalar)
      return next_by_network(child, hits, way);
    else
      return next_by_count(child, hits, way);
  }

  HIPRT_HD static HIPRT_INLINE unsigned take(std::uint32_t& mask) {
    const unsigned lowest = static_cast<unsigned>(std::countr_zero(mask));
    mask &= mask - 1;
    return lowest;
  }

 private:
  /// As few comparisons as there are hits: one or two, mostly.
  template <class Lanes, class Way>
  HIPRT_HD static HIPRT_INLINE NodeRef next_by_count(const NodeRef (&child)[kBranching], const BoxHits<Lanes>& hits,
                                                     Way& way) {
    std::uint32_t mask = hits.mask;
    alignas(16) float enter[kBranching];
    Lanes::store(enter, hits.enter);
    const auto take_entry = [&] {
      const unsigned i = take(mask);
      return make_entry(enter[i], child[i]);
    };
    StackEntry a = take_entry();
    if (mask == 0) return way.follow(a);
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
        way.later(d);
      }
      way.later(c);
    }
    way.later(b);
    return way.follow(a);
  }

  HIPRT_HD static HIPRT_INLINE void sort(StackEntry& a, StackEntry& b) {
    const StackEntry low = a < b ? a : b, high = a < b ? b : a;
    a = low;
    b = high;
  }

  struct Child {
    float enter;
    NodeRef ref;
  };

  /// Five compare-exchanges whatever the number of hits: no branches but the pushes.
  template <class Lanes, class Way>
  HIPRT_HD static HIPRT_INLINE NodeRef next_by_network(const NodeRef (&child)[kBranching], const BoxHits<Lanes>& hits,
                                                       Way& way) {
    constexpr float kMissed = std::numeric_limits<float>::infinity();
    const auto make = [&](unsigned i) { return Child{hits.hit(i) ? Lanes::get(hits.enter, i) : kMissed, child[i]}; };
    Child a = make(0), b = make(1), c = make(2), d = make(3);
    sort<Way>(a, c);
    sort<Way>(b, d);
    sort<Way>(a, b);
    sort<Way>(c, d);
    sort<Way>(b, c);
    if (d.enter < kMissed) way.later(make_entry(d.enter, d.ref));
    if (c.enter < kMissed) way.later(make_entry(c.enter, c.ref));
    if (b.enter < kMissed) way.later(make_entry(b.enter, b.ref));
    return way.follow(make_entry(a.enter, a.ref));
  }

  template <class Way> HIPRT_HD static HIPRT_INLINE void sort(Child& a, Child& b) {
    bool swap = b.enter < a.enter;
    if constexpr (Way::kNeedsStableOrder) swap = swap || (b.enter == a.enter && b.ref < a.ref);
    const Child low{swap ? b.enter : a.enter, swap ? b.ref : a.ref};
    b = Child{swap ? a.enter : b.enter, swap ? a.ref : b.ref};
    a = low;
  }
};

/// Children as they are stored. For any hit, where the first hit ends the search whatever its distance.
struct Unordered {
  using Entry = NodeRef;

  /// @pre hits.any()
  template <class Lanes, class Way>
  HIPRT_HD static HIPRT_INLINE NodeRef next(const NodeRef (&child)[kBranching], const BoxHits<Lanes>& hits, Way& way) {
    if (!way.make_room()) return kInvalidRef;
    if constexpr (Lanes::kScalar) {
      NodeRef first = kInvalidRef;
      const auto add = [&](unsigned i) HIPRT_INLINE_LAMBDA {
        if (!hits.hit(i)) return;
        if (first != kInvalidRef) way.later(first);
        first = child[i];
      };
      add(3);
      add(2);
      add(1);
      add(0);
      return way.follow(first);
    } else {
      std::uint32_t mask = hits.mask;
      const unsigned first = NearFirst::take(mask);
      while (mask != 0) way.later(child[NearFirst::take(mask)]);
      return way.follow(child[first]);
    }
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
