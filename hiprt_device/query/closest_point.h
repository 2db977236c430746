#pragma once
/// The points of a scene's triangles and custom primitives that are closest to a point.

#include <hiprt_device/instances/instance_path.h>
#include <hiprt_device/query/point_search.h>
#include <hiprt_device/query/query.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The triangles and custom primitives of a scene in the order of their distance from a point.
///
///     hiprt::NearestPoint<P> query(scene, {.point = p, .max_distance = 2.0f}, storage);
///     for (hiprt::ClosestPoint near = query.next_point(); near.found(); near = query.next_point()) ...
///
/// Each next_point() traverses the tree and finds the closest point behind the last one. The order is that of distance,
/// path of instances, geometry and primitive. So each is reported once, whatever the tree. nearest_points() finds
/// several in one traversal.
/// @tparam Primitives functors of the scene's custom primitives, a DistanceSet. They may be those of rays.
template <class P = Policies, class Filter = NoFilter, class Primitives = NoPrimitives> class NearestPoint {
  using Search = PointSearch<P, Filter, Primitives>;

 public:
  using Storage = typename Search::Storage;
  using Query = typename Search::Query;
  using Result = typename Search::Result;  ///< ClosestPoint, or PathClosestPoint with levels.

  /// @param scene must live as long as the query.
  /// @param storage of the stack; one traversal at a time may use it.
  /// @param filter is called as filter(query, point), with a Result.
  /// @param counter its counts are continued.
  HIPRT_HD HIPRT_FORCE_INLINE NearestPoint(const SceneView& scene, const Query& query, const Storage& storage,
                                           const Filter& filter = {}, const Primitives& primitives = {},
                                           const typename P::Counter& counter = {})
      : search_(scene, query, storage, filter, primitives, counter) {}
  /// Deleted: a query reads the scene until its end, and a temporary would be gone by then.
  template <class... Others> NearestPoint(const SceneView&&, Others&&...) = delete;

  /// @return the closest point behind the last one. One that is not found() at the end. failed() if it cannot be known
  /// (see state()).
  HIPRT_HD HIPRT_FORCE_INLINE Result next_point() {
    if (!search_.can_go_on()) return search_.nothing();
    Result best;
    bool stopped = false;
    search_.run([&](const Result& candidate, typename Search::Region& region) HIPRT_FORCE_INLINE_LAMBDA {
      if ((last_.found() && !precedes(last_, candidate)) || (best.found() && !precedes(candidate, best))) return true;
      const FilterResult answer = search_.ask(candidate);
      if (answer == FilterResult::kReject) return true;
      best = candidate;
      region.shrink(candidate.distance_squared);
      stopped = answer == FilterResult::kAcceptAndStop;
      return !stopped;
    });
    search_.conclude(best.found() && (stopped || !search_.overflowed()));
    if (search_.state() != TraversalState::kHit) return search_.nothing();
    last_ = best;
    return best;
  }

  HIPRT_HD HIPRT_FORCE_INLINE TraversalState state() const { return search_.state(); }
  /// The counts of P::Counter, over all calls.
  HIPRT_HD HIPRT_FORCE_INLINE const typename P::Counter& counter() const { return search_.counter(); }

 private:
  Search search_;
  Result last_;
};

/// The point of the scene's triangles and custom primitives that is closest to a point.
/// @param storage of the traversal's stack; one query at a time may use it.
/// @param primitives functors of the scene's custom primitives.
/// @return a point that is not found() if all are farther than max_distance.
template <class P, class Primitives = NoPrimitives>
HIPRT_HD inline auto closest_point(const SceneView& scene, const BasicPointQuery<typename PolicyCheck<P>::Real>& query,
                                   const typename PolicyCheck<P>::Storage& storage, const Primitives& primitives = {}) {
  return NearestPoint<P, NoFilter, Primitives>(scene, query, storage, {}, primitives).next_point();
}

/// The same with a stack of the function's own.
template <class P, DistanceSet Primitives = NoPrimitives>
HIPRT_HD inline auto closest_point(const SceneView& scene, const BasicPointQuery<typename PolicyCheck<P>::Real>& query,
                                   const Primitives& primitives = {}) {
  static_assert(OwnedStack<typename P::Stack>, "hiprt: this stack needs storage: pass it after the query");
  typename P::Stack::Memory memory;
  return closest_point<P>(scene, query, typename P::Stack::Storage(memory), primitives);
}

namespace query_detail {
struct ClosestPointInLayout {
  const SceneView& scene;
  const PointQuery& query;
  template <class Layout> HIPRT_HD ClosestPoint operator()(Layout) const {
    return closest_point<WithLayout<Layout>>(scene, query);
  }
};
}  // namespace query_detail

/// The same with the default policies, for a scene of any layout without instances.
/// @tparam Default a template, so that programs that do not call it do not compile it.
template <class Default = void>
requires std::same_as<Default, void> HIPRT_HD inline ClosestPoint closest_point(const SceneView& scene,
                                                                                const PointQuery& query) {
  return query_detail::with_layout(scene, query_detail::ClosestPointInLayout{scene, query});
}

/// The same for a point and the largest distance that counts.
template <class Default = void>
requires std::same_as<Default, void> HIPRT_HD inline ClosestPoint closest_point(
    const SceneView& scene, const Vec3& point, float max_distance = std::numeric_limits<float>::infinity()) {
  return closest_point(scene, PointQuery{point, max_distance});
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
