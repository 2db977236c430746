#pragma once
/// The closest hit of a ray, and the hits behind it.

#include <hiprt_device/query/query_core.h>
#include <hiprt_device/traverse/policy_checks.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The hits of a ray in the order of t.
///
///     hiprt::ClosestHit<P> query(scene, ray, stack);
///     for (hiprt::Hit hit = query.next_hit(); hit.found(); hit = query.next_hit()) ...  // in the order of t
///
/// Each next_hit() traverses the tree with the part of the ray behind the last hit. So hits come in the order of t,
/// geometry and primitive, each once, whatever the tree.
template <class P = Policies, class Filter = NoFilter, class Primitives = NoPrimitives> class ClosestHit {
  static_assert(QueryCheck<P, Filter, Primitives>::kChecked);
  using Search = HitSearch<P, typename P::ClosestOrder, SearchKind::kClosest, Filter, Primitives>;

 public:
  using Storage = typename Search::Storage;
  using Result = typename Search::Result;  ///< Hit, or PathHit with levels.

  /// @param scene must live as long as the query.
  /// @param storage of the stack; one traversal at a time may use it.
  /// @param counter its counts are continued.
  HIPRT_HD HIPRT_FORCE_INLINE ClosestHit(const SceneView& scene, const BasicRay<typename P::Real>& ray,
                                         const Storage& storage, const Filter& filter = {},
                                         const Primitives& primitives = {}, const typename P::Counter& counter = {})
      : search_(scene, ray, storage, filter, primitives, counter) {}
  /// Deleted: a query reads the scene until its end, and a temporary would be gone by then.
  template <class... Others> ClosestHit(const SceneView&&, Others&&...) = delete;

  /// @return the closest hit in [tmin, tmax] behind the last one, with normal and error. A miss at the end. failed()
  /// if the hit cannot be known (see state()).
  HIPRT_HD HIPRT_FORCE_INLINE Result next_hit() {
    static_assert(!P::Schedule::kBatchOnly, "hiprt: a WholeWave schedule is for trace_batch()");
    advance();
    return hit();
  }

  /// The result of the last next_hit(), advance() or advance_wave().
  HIPRT_HD HIPRT_FORCE_INLINE Result hit() const { return search_.complete_hit(); }

  /// next_hit() without its result: hit() returns that.
  HIPRT_HD HIPRT_FORCE_INLINE void advance() {
    if (!search_.can_go_on()) return;
    if (search_.state() == TraversalState::kHit) search_.start_behind_hit();
    search_.find_closest(false);
  }

  /// Traces a part of the first hit's traversal, for trace_batch() with a WholeWave schedule. All lanes of the wave
  /// call it.
  /// @return whether the result is ready: hit().
  HIPRT_HD HIPRT_FORCE_INLINE bool advance_wave(bool may_pause) { return search_.find_closest(may_pause); }
  /// Leaves nothing to visit, for lanes without a ray.
  HIPRT_HD HIPRT_FORCE_INLINE void cancel() { search_.cancel(); }

  HIPRT_HD HIPRT_FORCE_INLINE TraversalState state() const { return search_.state(); }
  /// The counts of P::Counter, over all calls.
  HIPRT_HD HIPRT_FORCE_INLINE const typename P::Counter& counter() const { return search_.counter(); }

 private:
  Search search_;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
