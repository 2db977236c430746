#pragma once
/// How many hits a ray has, and the first of them in order.

#include <hiprt_device/query/nearest_points.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The number of hits of a ray in [tmin, tmax]. Two neighbours that a ray meets in their common edge are two hits,
/// except with the triangle test Reference.
///
/// One traversal. Where a builder has split triangles (Feature::kSplitReferences) it takes one traversal per hit.
/// @param storage of the traversal's stack; one ray at a time may use it.
template <class P = Policies>
HIPRT_HD inline FoundCount count_hits(const SceneView& scene, const typename PolicyCheck<P>::Ray& ray,
                                      const typename PolicyCheck<P>::Storage& storage) {
  AllHits<P> query(scene, ray, storage);
  FoundCount found;
  while (query.next_hit().found()) ++found.count;
  found.state = query.state();
  return found;
}

/// The first hits of a ray in the order of t, path, geometry and primitive, each once, with normal and error.
///
/// One traversal per hit, each of the part of the ray behind the last hit. So the first hits do not cost more if there
/// are many.
/// @param hits for @p most of them.
/// @param filter as that of ClosestHit.
/// @return how many there are. kFinished: there are no more. kHit: there may be more.
template <class P = Policies, class Filter = NoFilter>
HIPRT_HD inline FoundCount list_hits(const SceneView& scene, const typename PolicyCheck<P>::Ray& ray,
                                     typename ClosestHit<P>::Result* hits, std::uint32_t most,
                                     const typename PolicyCheck<P>::Storage& storage, const Filter& filter = {}) {
  ClosestHit<P, Filter> query(scene, ray, storage, filter);
  FoundCount found{0, query.state()};
  while (found.count < most) {
    const auto hit = query.next_hit();
    found.state = query.state();
    if (found.state != TraversalState::kHit) break;
    hits[found.count++] = hit;
  }
  return found;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
