#pragma once
/// Whether a ray hits anything.

#include <hiprt_device/query/query_core.h>
#include <hiprt_device/traverse/policy_checks.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The hits of a ray in the order of the tree, without normal and error.
///
///     bool shadowed = hiprt::AnyHit<P>(scene, ray, stack).next_hit().found();
///
/// next_hit() continues after the last hit. A primitive that the builder has split (Feature::kSplitReferences) may be
/// reported more than once; AllHits reports it once.
template <class P = Policies, class Filter = NoFilter, class Primitives = NoPrimitives> class AnyHit {
  static_assert(QueryCheck<P, Filter, Primitives>::kChecked);
  using Search = HitSearch<P, typename P::AnyOrder, !P::Schedule::kBatchOnly, Filter, Primitives>;

 public:
  using Storage = typename Search::Storage;
  using Result = typename Search::Result;  ///< Hit, or PathHit with levels.

  /// @param scene must live as long as the query.
  /// @param storage of the stack; one traversal at a time may use it.
  /// @param counter its counts are continued.
  HIPRT_HD HIPRT_FORCE_INLINE AnyHit(const SceneView& scene, const BasicRay<typename P::Real>& ray,
                                     const Storage& storage, const Filter& filter = {},
                                     const Primitives& primitives = {}, const typename P::Counter& counter = {})
      : search_(scene, ray, storage, filter, primitives, counter) {}
  /// Deleted: a query reads the scene until its end, and a temporary would be gone by then.
  template <class... Others> AnyHit(const SceneView&&, Others&&...) = delete;

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

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
