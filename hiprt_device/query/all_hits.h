#pragma once
/// Every hit of a ray.

#include <hiprt_device/query/query_core.h>
#include <hiprt_device/traverse/policy_checks.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// What AllHits does about primitives that lie in several leaves (Feature::kSplitReferences).
enum class SplitPrimitives {
  kOnce,    ///< Each hit once.
  kRepeat,  ///< A hit may come once per leaf.
};

/// All hits of a ray in [tmin, tmax], with normal and error.
///
///     hiprt::AllHits<P> query(scene, ray, stack);
///     for (hiprt::Hit hit = query.next_hit(); hit.found(); hit = query.next_hit()) ...  // in no particular order
///
/// In a scene without split primitives this is one traversal that stops at each hit and goes on. In a scene with them,
/// and with kOnce, every next_hit() looks for the closest hit behind the last, as ClosestHit does: that is what each
/// one once costs. Policies without Feature::kSplitReferences have no code for it.
template <class P = Policies, class Filter = NoFilter, class Primitives = NoPrimitives,
          SplitPrimitives kSplit = SplitPrimitives::kOnce>
class AllHits {
  static_assert(QueryCheck<P, Filter, Primitives>::kChecked);
  static constexpr bool kMaySort =
      kSplit == SplitPrimitives::kOnce && (P::kFeatures & feature_bit(Feature::kSplitReferences)) != 0;
  using Order = std::conditional_t<kMaySort, typename P::ClosestOrder, typename P::AnyOrder>;
  using Search = HitSearch<P, Order, true, Filter, Primitives>;

 public:
  using Storage = typename Search::Storage;
  using Result = typename Search::Result;  ///< Hit; with levels PathHit.

  /// @param scene must live as long as this. @param storage of the stack; one traversal at a time may use it.
  /// @param counter goes on from what it is.
  HIPRT_HD HIPRT_INLINE AllHits(const SceneView& scene, const BasicRay<typename P::Real>& ray, const Storage& storage,
                                const Filter& filter = {}, const Primitives& primitives = {},
                                const typename P::Counter& counter = {})
      : search_(scene, ray, storage, filter, primitives, counter),
        sorts_(kMaySort && (scene.features & feature_bit(Feature::kSplitReferences)) != 0) {}
  /// A query reads the scene until its end: a temporary would be gone by then.
  template <class... Others> AllHits(const SceneView&&, Others&&...) = delete;

  /// @return one more hit; a miss at the end; failed() (see state()) if nodes could not be visited.
  HIPRT_HD HIPRT_INLINE Result next_hit() {
    static_assert(!P::Schedule::kBatchOnly, "hiprt: a WholeWave schedule is for trace_batch()");
    if (!search_.can_go_on()) return search_.hit();
    if constexpr (kMaySort) {
      if (sorts_) return next_behind();
    }
    search_.find_any(false);
    return search_.complete_hit();
  }

  HIPRT_HD HIPRT_INLINE TraversalState state() const { return search_.state(); }
  /// What P::Counter counted, over all calls.
  HIPRT_HD HIPRT_INLINE const typename P::Counter& counter() const { return search_.counter(); }

 private:
  HIPRT_HD HIPRT_INLINE Result next_behind() {
    if (search_.state() == TraversalState::kHit) search_.start_behind_hit();
    search_.find_closest(false);
    return search_.complete_hit();
  }

  Search search_;
  bool sorts_;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
