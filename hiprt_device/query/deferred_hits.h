#pragma once
/// Deferred decisions of closest-hit searches. Internal.
///
/// With a DeferringTest the search first computes only bounds of t. In the end it decides exactly for the triangles
/// that can still be the closest.

#include <hiprt_device/traverse/traverse.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Triangles (LeafHit::leaf) that are not decided: whether they are hit, or whether they are nearer.
template <class Real> struct OpenTriangles {
  NodeRef at_start = kInvalidRef;  ///< A triangle that may lie before the search's range: the one on which the ray
                                   ///< starts.
  NodeRef leaf = kInvalidRef, other = kInvalidRef;
  Real low = -std::numeric_limits<Real>::infinity();  ///< Lower bound of t of leaf and other.

  /// Adds a triangle.
  /// @return false: there are too many.
  HIPRT_HD HIPRT_FORCE_INLINE bool take(NodeRef triangle, Real triangle_low, bool is_behind_start) {
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
  /// Forgets the triangles behind the start.
  HIPRT_HD HIPRT_FORCE_INLINE void forget() {
    leaf = other = kInvalidRef;
    low = -std::numeric_limits<Real>::infinity();
  }
  HIPRT_HD HIPRT_FORCE_INLINE bool is_empty() const { return at_start == kInvalidRef && leaf == kInvalidRef; }
  HIPRT_HD HIPRT_FORCE_INLINE bool is_crowded() const { return other == kOverflowRef; }
};

/// Empty in a search that decides at once. Otherwise t of the current hit is in [low, the search's limit].
template <bool kDefers, class Real> struct DeferredHits {};
template <class Real> struct DeferredHits<true, Real> {
  Real low = Real(0);
  OpenTriangles<Real> open{};
};

namespace deferred_detail {
template <bool kDefers, class Test> struct SearchTest { using Type = Test; };
template <class Test> struct SearchTest<true, Test> { using Type = typename Test::Bounds; };
}  // namespace deferred_detail

/// The test that a search calls in the tree: the policy's test, or its Bounds.
template <bool kDefers, class Test> using SearchTest = typename deferred_detail::SearchTest<kDefers, Test>::Type;

/// The steps of a HitSearch that defers its decisions.
template <class Search> class DeferredDecisions {
  using P = typename Search::PolicyType;
  using Real = typename P::Real;

 public:
  HIPRT_HD HIPRT_FORCE_INLINE explicit DeferredDecisions(Search& search) : search_(search) {}

  /// Searches with bounds of t. Afterwards limit_ and deferred_.low are the bounds of the current hit.
  ///
  /// Triangles stay open if the bounds do not tell whether they are hit, or nearer. If too many are open, the search
  /// is crowded and ends.
  HIPRT_HD HIPRT_FORCE_INLINE Outcome search(bool may_pause) {
    Search& s = search_;
    return s.traversal_.run(*s.scene_, s.ray_, s.limit_, s.primitives_, s.counter_, may_pause,
                            [&](const LeafHit<Real>& found) HIPRT_FORCE_INLINE_LAMBDA {
                              const Real high = found.at.t, low = found.at.u;
                              if (high < s.after_t_ || low > s.limit_) return true;
                              if (low > s.after_t_ && high < s.deferred_.low) {
                                if (!s.accept(found)) return true;
                                s.limit_ = high;
                                s.deferred_.low = low;
                                if (s.deferred_.open.low > high) s.deferred_.open.forget();
                                return true;
                              }
                              return s.deferred_.open.take(found.leaf, low, low > s.after_t_);
                            });
  }

  /// Decides the current hit and the open triangles. The result is that of a search that decides at once.
  HIPRT_HD HIPRT_FORCE_INLINE void decide_hits() {
    Search& s = search_;
    if (s.leaf_ != kInvalidRef) {
      BasicCandidate<Real> at{};
      decide(s.leaf_, load_info(s.scene_->base + ref_offset(s.leaf_)), at);
      s.limit_ = at.t;
      s.hit_.u = at.u;
      s.hit_.v = at.v;
    }
    if (s.deferred_.open.is_empty()) return;
    NodeRef leaf = s.deferred_.open.at_start;
    HIPRT_NO_UNROLL
    for (unsigned i = 0; i < 3; ++i, leaf = i == 1 ? s.deferred_.open.leaf : s.deferred_.open.other) {
      if (leaf == kInvalidRef) continue;
      const LeafInfo info = load_info(s.scene_->base + ref_offset(leaf));
      LeafHit<Real> found{{},
                          nullptr,
                          info.geometry_and_flags & kGeometryMask,
                          choose((leaf & 1u) != 0, info.primitive[1], info.primitive[0]),
                          leaf};
      if (decide(leaf, info, found.at) && s.take_closest(found)) s.limit_ = found.at.t;
    }
    s.deferred_.open = {};
  }

  /// Searches again with immediate decisions, each ray by itself. This is very rare.
  /// @return true
  HIPRT_HD HIPRT_FORCE_INLINE bool search_again() {
    Search& s = search_;
    Traversal<Alone, typename Search::OrderType, false> traversal(*s.scene_, s.ray_.get(), s.scene_->root, s.storage_);
    traversal.restart(*s.scene_, s.ray_.get(), s.after_t_, s.storage_);
    s.limit_ = Search::finite(s.ray_.get().tmax);
    s.forget_hit();
    s.deferred_.open = {};
    traversal.run(*s.scene_, s.ray_, s.limit_, s.primitives_, s.counter_, false,
                  [&](const LeafHit<Real>& found) HIPRT_FORCE_INLINE_LAMBDA {
                    if (s.take_closest(found)) s.limit_ = found.at.t;
                    return true;
                  });
    s.hit_.t = s.limit_;
    // The stack was large enough for the first traversal, as far as it went. Report if it is too small for this one.
    if (traversal.overflowed()) s.traversal_.overflow();
    s.conclude(s.hit_.found() && !traversal.overflowed());
    return true;
  }

 private:
  struct Alone : P {
    using Schedule = Immediate;
  };

  /// The test's decision for a triangle.
  /// @param leaf LeafHit::leaf.
  HIPRT_HD HIPRT_FORCE_INLINE bool decide(NodeRef leaf, const LeafInfo& info, BasicCandidate<Real>& at) const {
    const bool second = (leaf & 1u) != 0;
    return P::Triangle::template decide<typename P::Lanes>(
        *reinterpret_cast<const typename P::Layout::Leaf*>(search_.scene_->base + ref_offset(leaf)),
        search_.traversal_.prepared_ray(), second, info.triangle_ids >> (second ? 8 : 0), at);
  }

  Search& search_;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
