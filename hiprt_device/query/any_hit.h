#pragma once
/// Whether a ray hits anything.

#include <hiprt_device/query/query_core.h>
#include <hiprt_device/traverse/policy_checks.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// What AnyHit and OneHit share.
template <class P, class Filter, class Primitives, SearchKind kKind> class AnyHitQuery {
  static_assert(QueryCheck<P, Filter, Primitives>::kChecked);
  using Search = HitSearch<P, typename P::AnyOrder, kKind, Filter, Primitives>;

 public:
  using Storage = typename Search::Storage;
  using Result = typename Search::Result;  ///< Hit, or PathHit with levels.

  /// @param scene must live as long as the query.
  /// @param storage of the stack; one traversal at a time may use it.
  /// @param counter its counts are continued.
  HIPRT_HD HIPRT_FORCE_INLINE AnyHitQuery(const SceneView& scene, const BasicRay<typename P::Real>& ray,
                                          const Storage& storage, const Filter& filter = {},
                                          const Primitives& primitives = {}, const typename P::Counter& counter = {})
      : search_(scene, ray, storage, filter, primitives, counter) {}
  /// Deleted: a query reads the scene until its end, and a temporary would be gone by then.
  template <class... Others> AnyHitQuery(const SceneView&&, Others&&...) = delete;

  /// @return one more hit in [tmin, tmax]; a miss at the end; failed() if nodes could not be visited (see state()).
  HIPRT_HD HIPRT_FORCE_INLINE Result next_hit() {
    static_assert(!P::Schedule::kBatchOnly, "hiprt: a WholeWave schedule is for trace_batch()");
    advance();
    return hit();
  }

  /// The result of the last next_hit() or advance().
  HIPRT_HD HIPRT_FORCE_INLINE Result hit() const { return search_.hit(); }

  /// next_hit() without its result: hit() returns that.
  HIPRT_HD HIPRT_FORCE_INLINE void advance() {
    if (search_.can_go_on()) search_.find_any(false);
  }

  /// As the functions of ClosestHit.
  HIPRT_HD HIPRT_FORCE_INLINE bool advance_wave(bool may_pause) { return search_.find_any(may_pause); }
  HIPRT_HD HIPRT_FORCE_INLINE void cancel() { search_.cancel(); }

  HIPRT_HD HIPRT_FORCE_INLINE TraversalState state() const { return search_.state(); }
  /// The counts of P::Counter, over all calls.
  HIPRT_HD HIPRT_FORCE_INLINE const typename P::Counter& counter() const { return search_.counter(); }

 private:
  Search search_;
};

/// The hits of a ray in the order of the tree, without normal and error.
///
///     hiprt::AnyHit<P> query(scene, ray, stack);
///     while (query.next_hit().found()) ++count;
///
/// next_hit() continues after the last hit. A primitive that the builder has split (Feature::kSplitReferences) may be
/// reported more than once; AllHits reports it once.
template <class P = Policies, class Filter = NoFilter, class Primitives = NoPrimitives>
class AnyHit
    : public AnyHitQuery<P, Filter, Primitives, P::Schedule::kBatchOnly ? SearchKind::kOne : SearchKind::kEach> {
 public:
  using AnyHit::AnyHitQuery::AnyHitQuery;
};

/// One hit of a ray, any of them, without normal and error. next_hit() may be called once. On GPUs this needs fewer
/// registers than AnyHit.
///
///     bool shadowed = hiprt::OneHit<P>(scene, ray, stack).next_hit().found();
template <class P = Policies, class Filter = NoFilter, class Primitives = NoPrimitives>
class OneHit : public AnyHitQuery<P, Filter, Primitives, SearchKind::kOne> {
 public:
  using OneHit::AnyHitQuery::AnyHitQuery;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
