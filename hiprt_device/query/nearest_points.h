#pragma once
/// The k triangles or custom primitives nearest to a point, and all within a distance, in one traversal.

#include <hiprt_device/query/all_hits.h>
#include <hiprt_device/query/closest_point.h>

namespace hiprt {

/// What a query for several results has found.
struct FoundCount {
  std::uint32_t count = 0;
  /// kFinished: all that there are. kHit: there may be more. kStackOverflow, kRefused: see failed().
  TraversalState state = TraversalState::kFinished;

  /// Whether results may be missing: the stack was too small, or the policies do not cover the scene.
  HIPRT_HD bool failed() const { return state == TraversalState::kStackOverflow || state == TraversalState::kRefused; }
};

inline namespace HIPRT_ISA_NAMESPACE {

namespace nearest_detail {

/// Puts a result at its place among @p count sorted ones, and drops the last if there are @p most.
/// @return false: it is there already, or behind all and there is no room.
template <class Result>
HIPRT_HD HIPRT_FORCE_INLINE bool insert(Result* sorted, std::uint32_t& count, std::uint32_t most,
                                        const Result& result) {
  std::uint32_t at = count;
  while (at > 0 && precedes(result, sorted[at - 1])) --at;
  const bool is_there = at > 0 && !precedes(sorted[at - 1], result);
  if (is_there || at == most) return false;
  if (count < most) ++count;
  for (std::uint32_t i = count - 1; i > at; --i) sorted[i] = sorted[i - 1];
  sorted[at] = result;
  return true;
}

}  // namespace nearest_detail

/// The triangles and custom primitives nearest to a point, the nearest first, each once.
///
/// One traversal. The array is kept in order by insertion, so it is for small numbers: up to about 64.
/// @param results for @p most of them.
/// @param storage of the traversal's stack; one query at a time may use it.
/// @param filter is called as filter(query, point). kAcceptAndStop ends the search with what it has.
/// @param primitives functors of the scene's custom primitives.
/// @return how many there are. If it failed, the results are true, but nearer ones may be missing.
template <class P = Policies, class Filter = NoFilter, class Primitives = NoPrimitives>
HIPRT_HD inline FoundCount nearest_points(const SceneView& scene,
                                          const BasicPointQuery<typename PolicyCheck<P>::Real>& query,
                                          ClosestPointOf<typename P::Real, P::kLevels>* results, std::uint32_t most,
                                          const typename PolicyCheck<P>::Storage& storage, const Filter& filter = {},
                                          const Primitives& primitives = {}) {
  using Search = PointSearch<P, Filter, Primitives>;
  using Result = typename Search::Result;
  Search search(scene, query, storage, filter, primitives, {});
  FoundCount found{0, search.state()};
  if (!search.can_go_on() || most == 0) return found;
  bool is_full = false;
  search.run([&](const Result& candidate, typename Search::Region& region) HIPRT_FORCE_INLINE_LAMBDA {
    if (found.count == most && !precedes(candidate, results[most - 1])) return true;
    const FilterResult answer = search.ask(candidate);
    if (answer == FilterResult::kReject || !nearest_detail::insert(results, found.count, most, candidate)) return true;
    is_full = found.count == most;
    if (is_full) region.shrink(results[most - 1].distance_squared);
    return answer != FilterResult::kAcceptAndStop;
  });
  search.conclude(false);
  found.state = search.state() == TraversalState::kFinished && is_full ? TraversalState::kHit : search.state();
  return found;
}

/// Calls take(point) for each triangle and custom primitive within query.max_distance, each once, in no particular
/// order.
///
/// One traversal. Where a builder has split triangles (Feature::kSplitReferences) it takes one traversal per triangle,
/// in the order of distance. SplitPrimitives::kRepeat asks for one traversal and accepts repetitions.
/// @param take bool(const Result&): false stops.
/// @param primitives functors of the scene's custom primitives.
/// @return how many times it was called. kHit: take() has stopped.
template <class P = Policies, SplitPrimitives kSplit = SplitPrimitives::kOnce, class Take = void,
          class Primitives = NoPrimitives>
HIPRT_HD inline FoundCount points_within(const SceneView& scene,
                                         const BasicPointQuery<typename PolicyCheck<P>::Real>& query,
                                         const typename PolicyCheck<P>::Storage& storage, Take&& take,
                                         const Primitives& primitives = {}) {
  using Search = PointSearch<P, NoFilter, Primitives>;
  using Result = typename Search::Result;
  FoundCount found;
  constexpr bool kMaySort =
      kSplit == SplitPrimitives::kOnce && (P::kFeatures & feature_bit(Feature::kSplitReferences)) != 0;
  if constexpr (kMaySort) {
    if ((scene.features & feature_bit(Feature::kSplitReferences)) != 0) {
      NearestPoint<P, NoFilter, Primitives> points(scene, query, storage, {}, primitives);
      bool go_on = true;
      while (go_on) {
        const Result point = points.next_point();
        if (!point.found()) break;
        ++found.count;
        go_on = take(point);
      }
      found.state = go_on ? points.state() : TraversalState::kHit;
      return found;
    }
  }
  Search search(scene, query, storage, {}, primitives, {});
  found.state = search.state();
  if (!search.can_go_on()) return found;
  bool go_on = true;
  search.run([&](const Result& candidate, typename Search::Region&) HIPRT_FORCE_INLINE_LAMBDA {
    ++found.count;
    return go_on = take(candidate);
  });
  search.conclude(!go_on);
  found.state = search.state();
  return found;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
