#pragma once
/// All hits of a ray.

#include <hiprt_device/query/query_core.h>
#include <hiprt_device/traverse/policy_checks.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// What AllHits does with primitives that lie in several leaves (Feature::kSplitReferences).
enum class SplitPrimitives {
  kOnce,    ///< Each hit is reported once.
  kRepeat,  ///< A hit may be reported once per leaf.
};

/// All hits of a ray in [tmin, tmax], with normal and error.
///
///     hiprt::AllHits<P> query(scene, ray, stack);
///     for (hiprt::Hit hit = query.next_hit(); hit.found(); hit = query.next_hit()) ...  // in no particular order
///
/// In a scene without split primitives this is one traversal that stops at each hit and continues.
///
/// In a scene with split primitives, kOnce costs one traversal per hit. Each next_hit() then searches the closest hit
/// behind the last one, as ClosestHit does. Policies without Feature::kSplitReferences have no code for this.
template <class P = Policies, class Filter = NoFilter, class Primitives = NoPrimitives,
          SplitPrimitives kSplit = SplitPrimitives::kOnce>
class AllHits {
  static_assert(QueryCheck<P, Filter, Primitives>::kChecked);
  static constexpr bool kMaySort =
      kSplit == SplitPrimitives::kOnce && (P::kFeatures & feature_bit(Feature::kSplitReferences)) != 0;
  using Order = std::conditional_t<kMaySort, typename P::ClosestOrder, typename P::AnyOrder>;
  using Search = HitSearch<P, Order, SearchKind::kEach, Filter, Primitives>;

 public:
  using Storage = typename Search::Storage;
  using Result = typename Search::Result;  ///< Hit, or PathHit with levels.

  /// @param scene must live as long as the query.
  /// @param storage of the stack; one traversal at a time may use it.
  /// @param counter its counts are continued.
  HIPRT_HD HIPRT_FORCE_INLINE AllHits(const SceneView& scene, const BasicRay<typename P::Real>& ray,
                                      const Storage& storage, const Filter& filter = {},
                                      const Primitives& primitives = {}, const typename P::Counter& counter = {})
      : search_(scene, ray, storage, filter, primitives, counter),
        sorts_(kMaySort && (scene.features & feature_bit(Feature::kSplitReferences)) != 0) {}
  /// Deleted: a query reads the scene until its end, and a temporary would be gone by then.
  template <class... Others> AllHits(const SceneView&&, Others&&...) = delete;

  /// @return one more hit; a miss at the end; failed() if nodes could not be visited (see state()).
  HIPRT_HD HIPRT_FORCE_INLINE Result next_hit() {
    static_assert(!P::Schedule::kBatchOnly, "hiprt: a WholeWave schedule is for trace_batch()");
    if (!search_.can_go_on()) return search_.hit();
    if constexpr (kMaySort) {
      if (sorts_) return next_behind();
    }
    search_.find_any(false);
    return search_.complete_hit();
  }

  HIPRT_HD HIPRT_FORCE_INLINE TraversalState state() const { return search_.state(); }
  /// The counts of P::Counter, over all calls.
  HIPRT_HD HIPRT_FORCE_INLINE const typename P::Counter& counter() const { return search_.counter(); }

 private:
  HIPRT_HD HIPRT_FORCE_INLINE Result next_behind() {
    if (search_.state() == TraversalState::kHit) search_.start_behind_hit();
    search_.find_closest(false);
    return search_.complete_hit();
  }

  Search search_;
  bool sorts_;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
