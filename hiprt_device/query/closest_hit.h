#pragma once
/// The closest hit of a ray, and the ones behind it.

#include <hiprt_device/query/query_core.h>
#include <hiprt_device/traverse/policy_checks.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// A closest-hit traversal.
///
///     hiprt::ClosestHit<P> query(scene, ray, stack);
///     for (hiprt::Hit hit = query.next_hit(); hit.found(); hit = query.next_hit()) ...  // in the order of t
///
/// Every next_hit() is a traversal of its own, of the part of the ray behind the last hit, so that hits come in the
/// order of t, geometry and primitive, each once, however the tree was built.
template <class P = Policies, class Filter = NoFilter, class Primitives = NoPrimitives> class ClosestHit {
  static_assert(QueryCheck<P, Filter, Primitives>::kChecked);
  using Search = HitSearch<P, typename P::ClosestOrder, false, Filter, Primitives>;

 public:
  using Storage = typename Search::Storage;
  using Result = typename Search::Result;  ///< Hit; with levels PathHit.

  /// @param scene must live as long as this. @param storage of the stack; one traversal at a time may use it.
  /// @param counter goes on from what it is.
  HIPRT_HD HIPRT_INLINE ClosestHit(const SceneView& scene, const BasicRay<typename P::Real>& ray,
                                   const Storage& storage, const Filter& filter = {}, const Primitives& primitives = {},
                                   const typename P::Counter& counter = {})
      : search_(scene, ray, storage, filter, primitives, counter) {}
  /// A query reads the scene until its end: a temporary would be gone by then.
  template <class... Others> ClosestHit(const SceneView&&, Others&&...) = delete;

  /// @return the closest hit in [tmin, tmax] behind the last one, with normal and error; a miss at the end; failed()
  /// (see state()) when it cannot be told.
  HIPRT_HD HIPRT_INLINE Result next_hit() {
    static_assert(!P::Schedule::kBatchOnly, "hiprt: a WholeWave schedule is for trace_batch()");
    advance();
    return hit();
  }

  /// The last answer.
  HIPRT_HD HIPRT_INLINE Result hit() const { return search_.complete_hit(); }

  /// next_hit() without its result, which hit() then has.
  HIPRT_HD HIPRT_INLINE void advance() {
    if (!search_.can_go_on()) return;
    if (search_.state() == TraversalState::kHit) search_.start_behind_hit();
    search_.find_closest(false);
  }

  /// For trace_batch(), with a WholeWave schedule: a part of the way to the first hit. All lanes of the wave call it.
  /// @return whether the answer is there, for hit().
  HIPRT_HD HIPRT_INLINE bool advance_wave(bool may_pause) { return search_.find_closest(may_pause); }
  /// Nothing is left to visit: for lanes without a ray.
  HIPRT_HD HIPRT_INLINE void cancel() { search_.cancel(); }

  HIPRT_HD HIPRT_INLINE TraversalState state() const { return search_.state(); }
  /// What P::Counter counted, over all calls.
  HIPRT_HD HIPRT_INLINE const typename P::Counter& counter() const { return search_.counter(); }

 private:
  Search search_;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
