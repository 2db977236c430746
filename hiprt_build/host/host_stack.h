#pragma once
/// The nodes that a search on the host visits next and later. Internal; for sources compiled with AVX2 and FMA.

#include <hiprt_build/host/host_node.h>
#include <hiprt_build/host/wide_lanes.h>

#include <bit>
#include <limits>

namespace hiprt::format_detail {
inline namespace HIPRT_ISA_NAMESPACE {

/// The children of a node that are met, and at what distance.
struct HostBoxes {
  std::uint32_t met;
  WideLanes::Float enter;
};

/// Removes the lowest bit of a mask. @return its number.
HIPRT_FORCE_INLINE unsigned take_lowest(std::uint32_t& mask) {
  const unsigned lowest = static_cast<unsigned>(std::countr_zero(mask));
  mask &= mask - 1;
  return lowest;
}

/// @tparam kSorted whether nearer nodes are visited first, and those beyond a limit not at all. For closest hits.
template <bool kSorted> class HostStack {
  struct Entry {
    HostRef ref;
    float enter;
  };
  struct PlainEntry {
    HostRef ref;
  };
  using Kept = std::conditional_t<kSorted, Entry, PlainEntry>;

 public:
  /// The position of a search: the next reference and the end of the stack. It is apart from the entries, so that a
  /// loop can keep it in registers.
  struct Cursor {
    HostRef next;  ///< The node or leaves to visit next. is_none(): the search has ended.
    Kept* top;     ///< Behind the last entry.

    /// @param limit the search's.
    HIPRT_FORCE_INLINE void pop([[maybe_unused]] float limit) {
      --top;
      if constexpr (kSorted)
        while (!(top->enter <= limit)) --top;
      next = top->ref;
    }

    /// Goes on below a node that was next. Prefetches all children that are met.
    HIPRT_FORCE_INLINE void visit(const HostNode& node, const HostBoxes& boxes, float limit) {
      std::uint32_t met = boxes.met;
      if (met == 0) return pop(limit);
      const unsigned first = take_lowest(met);
      next = node.child[first];
      prefetch(next);
      if (met == 0) return;
      alignas(32) float enter[kWideBranching];
      if constexpr (kSorted) {
        WideLanes::store(enter, boxes.enter);
        visit_nearest(node, enter, first, met);
      } else {
        do push(entry(node, enter, take_lowest(met)));
        while (met != 0);
      }
    }

    HIPRT_FORCE_INLINE void push(const Entry& entry) {
      if constexpr (kSorted)
        *top++ = entry;
      else
        *top++ = {entry.ref};
    }

   private:
    HIPRT_FORCE_INLINE static void prefetch(HostRef ref) {
      for (unsigned line = 0; line < sizeof(HostNode) / 64; ++line) __builtin_prefetch(ref.address() + 64 * line);
    }
    HIPRT_FORCE_INLINE static Entry entry(const HostNode& node, const float (&enter)[kWideBranching], unsigned child) {
      prefetch(node.child[child]);
      return {node.child[child], kSorted ? enter[child] : 0.0f};
    }
    HIPRT_FORCE_INLINE static void sort(Entry& nearer, Entry& farther) {
      const bool swap = farther.enter < nearer.enter;
      const Entry a = nearer, b = farther;
      nearer = {swap ? b.ref : a.ref, swap ? b.enter : a.enter};
      farther = {swap ? a.ref : b.ref, swap ? a.enter : b.enter};
    }

    /// Makes the nearest child next and pushes the others, the farthest first.
    /// @param first a met child. @param others the other ones; not 0.
    HIPRT_FORCE_INLINE void visit_nearest(const HostNode& node, const float (&enter)[kWideBranching], unsigned first,
                                          std::uint32_t others) {
      Entry nearest{next, enter[first]}, second = entry(node, enter, take_lowest(others));
      sort(nearest, second);
      if (others == 0) {
        next = nearest.ref;
        return push(second);
      }
      Entry third = entry(node, enter, take_lowest(others));
      sort(second, third);
      sort(nearest, second);
      next = nearest.ref;
      Kept* const bottom = top;
      push(third);
      push(second);
      if (others == 0) return;
      push(nearest);
      do {
        const Entry later = entry(node, enter, take_lowest(others));
        Kept* at = top++;
        for (; at != bottom && at[-1].enter < later.enter; --at) at[0] = at[-1];
        *at = later;
      } while (others != 0);
      next = (--top)->ref;
    }
  };

  HostStack() = default;
  // Cursors point into it.
  HostStack(const HostStack&) = delete;
  HostStack& operator=(const HostStack&) = delete;

  /// @param root none(): a search that has ended.
  HIPRT_FORCE_INLINE Cursor start(HostRef root) {
    Cursor cursor{root, entries_};
    cursor.push({HostRef::none(), -std::numeric_limits<float>::infinity()});
    return cursor;
  }

 private:
  Kept entries_[kHostStack + 1];
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::format_detail
