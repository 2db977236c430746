#pragma once
/// What a search knows of hits while their decision is put off (DeferringTest). Internal.

#include <hiprt_device/traverse/stacks/stack.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Triangles (LeafHit::leaf) of which it is not known yet whether they are hit, or nearer.
template <class Real> struct OpenTriangles {
  NodeRef at_start = kInvalidRef;  ///< Maybe before the search's range: what the ray starts on.
  NodeRef leaf = kInvalidRef, other = kInvalidRef;
  Real low = -std::numeric_limits<Real>::infinity();  ///< t of leaf and other is not below.

  /// @return false: they are too many.
  HIPRT_HD HIPRT_INLINE bool take(NodeRef triangle, Real triangle_low, bool is_behind_start) {
    if (!is_behind_start && at_start == kInvalidRef) {
      at_start = triangle;
      return true;
    }
    if (leaf == kInvalidRef) {
      leaf = triangle;
      low = triangle_low;
      return true;
    }
    low = triangle_low < low ? triangle_low : low;
    const bool has_room = other == kInvalidRef;
    other = has_room ? triangle : kOverflowRef;
    return has_room;
  }
  /// Those behind the start.
  HIPRT_HD HIPRT_INLINE void forget() {
    leaf = other = kInvalidRef;
    low = -std::numeric_limits<Real>::infinity();
  }
  HIPRT_HD HIPRT_INLINE bool is_empty() const { return at_start == kInvalidRef && leaf == kInvalidRef; }
  HIPRT_HD HIPRT_INLINE bool is_crowded() const { return other == kOverflowRef; }
};

/// Nothing in a search that decides at once; else t of the hit at hand is in [low, the search's limit].
template <bool kDefers, class Real> struct UndecidedHits {};
template <class Real> struct UndecidedHits<true, Real> {
  Real low = Real(0);
  OpenTriangles<Real> open{};
};

namespace undecided_detail {
template <bool kDefers, class Test> struct OnTheWay { using Type = Test; };
template <class Test> struct OnTheWay<true, Test> { using Type = typename Test::Bounds; };
}  // namespace undecided_detail

/// What a search asks on its way: the test or its bounds.
template <bool kDefers, class Test> using TestOnTheWay = typename undecided_detail::OnTheWay<kDefers, Test>::Type;

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
