#pragma once
/// In which order the children that a ray meets are visited: a policy that picks the next node and pushes the others.

#include <hiprt_device/box_test.h>
#include <hiprt_device/stack.h>

#include <bit>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Nearest child first, the others on the stack so that the nearer is on top. For closest hits.
struct NearFirst {
  /// @pre hits.mask != 0
  template <class Lanes, TraversalStack Stack>
  HIPRT_HD static HIPRT_INLINE NodeRef next(const NodeRef* child, const BoxHits<Lanes>& hits, Stack& stack) {
    std::uint32_t mask = hits.mask;
    const unsigned first = take(mask);
    if (mask == 0) return child[first];
    alignas(16) float enter[kBranching];
    Lanes::store(enter, hits.enter);
    StackEntry a = make_entry(enter[first], child[first]);
    const unsigned second = take(mask);
    StackEntry b = make_entry(enter[second], child[second]);
    sort(a, b);
    if (mask != 0) {
      const unsigned third = take(mask);
      StackEntry c = make_entry(enter[third], child[third]);
      sort(b, c);
      sort(a, b);
      if (mask != 0) {
        const unsigned fourth = take(mask);
        StackEntry d = make_entry(enter[fourth], child[fourth]);
        sort(c, d);
        sort(b, c);
        sort(a, b);
        stack.push(d);
      }
      stack.push(c);
    }
    stack.push(b);
    return entry_ref(a);
  }

  HIPRT_HD static HIPRT_INLINE unsigned take(std::uint32_t& mask) {
    const unsigned lowest = static_cast<unsigned>(std::countr_zero(mask));
    mask &= mask - 1;
    return lowest;
  }

 private:
  HIPRT_HD static HIPRT_INLINE void sort(StackEntry& a, StackEntry& b) {
    const StackEntry low = a < b ? a : b, high = a < b ? b : a;
    a = low;
    b = high;
  }
};

/// Children as they are stored. For any hit, where the first hit ends the search whatever its distance.
struct Unordered {
  /// @pre hits.mask != 0
  template <class Lanes, TraversalStack Stack>
  HIPRT_HD static HIPRT_INLINE NodeRef next(const NodeRef* child, const BoxHits<Lanes>& hits, Stack& stack) {
    std::uint32_t mask = hits.mask;
    const unsigned first = NearFirst::take(mask);
    while (mask != 0) stack.push(make_entry(0.0f, child[NearFirst::take(mask)]));
    return child[first];
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
