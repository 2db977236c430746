#pragma once
/// The triangles that overlap a box, a sphere, an oriented box, a frustum or a triangle.

#include <hiprt_device/intersect/exact_box.h>
#include <hiprt_device/query/nearest_points.h>
#include <hiprt_device/traverse/volume_region.h>

namespace hiprt {

/// A box whose overlaps are decided exactly: no triangle is missed, and none is reported that does not touch it. In
/// instances the corners are rounded first, so there are no exact decisions.
struct ExactBox {
  Box box;
};

/// What a query for overlaps sees: geometries and instances with (mask & theirs) != 0, at a time.
struct Visibility {
  std::uint32_t mask = 0xffffffffu;
  float time = 0.0f;
};

/// A triangle that overlaps a volume. Geometry and primitive are those of the object at the end of the path.
template <unsigned kLevels> struct BasicOverlap {
  std::uint32_t geometry = kInvalidId, primitive = kInvalidId;
  TraversalState state = TraversalState::kFinished;  ///< Of the query.
  InstancePath<kLevels> path{};

  HIPRT_HD bool found() const { return primitive != kInvalidId; }
  /// Whether the query failed: it is not known whether there is an overlap.
  HIPRT_HD bool failed() const { return state == TraversalState::kStackOverflow || state == TraversalState::kRefused; }
};

inline namespace HIPRT_ISA_NAMESPACE {

/// A volume that is the hull of its corners.
template <class Volume>
concept HullVolume = requires(const Volume& volume) {
  { convex(volume) } -> std::same_as<ConvexVolume>;
};

namespace overlap_detail {

/// Visits the triangles that are not certainly apart from a convex volume.
template <class P, class Take>
HIPRT_HD inline TraversalState visit_convex(const SceneView& scene, const ConvexVolume& volume,
                                            const Visibility& visible, const typename P::Stack::Storage& storage,
                                            Take&& take) {
  RegionTraversal<P, typename P::AnyOrder> traversal(scene, volume.corners == 0 ? kInvalidRef : scene.root, storage);
  VolumeRegion<typename P::Lanes, P::kLevels> region(scene, volume);
  const BasicRay<typename P::Real> masked{.mask = visible.mask};
  typename P::Counter counter;
  const bool ended = traversal.run(scene, region, visible.mask, visible.time, counter,
                                   [&](const RegionTriangle& triangle) HIPRT_FORCE_INLINE_LAMBDA {
                                     if (!is_visible<P>(scene, traversal.levels(), masked, triangle.geometry) ||
                                         is_apart(volume, triangle.corner, region.vertex_error()))
                                       return true;
                                     return take(triangle, traversal.levels());
                                   });
  if (!ended) return TraversalState::kHit;
  if (!traversal.overflowed()) return TraversalState::kFinished;
  if constexpr (requires { storage.on_overflow(); }) storage.on_overflow();
  return TraversalState::kStackOverflow;
}

template <class P> HIPRT_HD HIPRT_FORCE_INLINE bool is_refused(const SceneView& scene) {
  return !covers<P>(scene) || (scene.features & feature_bit(Feature::kCustom)) != 0;
}

}  // namespace overlap_detail

/// Calls take(overlap) for each triangle that touches or overlaps a volume, in no particular order.
///
/// No such triangle is left out. Triangles that are nearer than rounding (about 2^-48 of the coordinates) may be
/// reported too. A triangle that a builder has split (Feature::kSplitReferences) may be reported once per leaf.
/// @param volume Box, OrientedBox, Frustum or TriangleVolume. A volume that is not finite overlaps anything or nothing.
/// @param take bool(const BasicOverlap<P::kLevels>&): false stops.
/// @return how many times it was called. kHit: take() has stopped.
template <class P = Policies, HullVolume Volume, class Take>
HIPRT_HD inline FoundCount overlaps(const SceneView& scene, const Volume& volume,
                                    const typename PolicyCheck<P>::Storage& storage, Take&& take,
                                    const Visibility& visible = {}) {
  FoundCount found;
  if (overlap_detail::is_refused<P>(scene)) return {0, TraversalState::kRefused};
  using LevelsOf = Levels<P::kLevels, P::kMoves, typename P::Real>;
  const auto visit = [&](const RegionTriangle& triangle, const LevelsOf& levels) HIPRT_FORCE_INLINE_LAMBDA {
    ++found.count;
    BasicOverlap<P::kLevels> overlap{triangle.geometry, triangle.primitive, TraversalState::kHit};
    if constexpr (P::kLevels != 0) overlap.path = levels.path();
    return take(overlap);
  };
  found.state = overlap_detail::visit_convex<P>(scene, convex(volume), visible, storage, visit);
  return found;
}

/// The same for a box, decided exactly.
template <class P = Policies, class Take>
HIPRT_HD inline FoundCount overlaps(const SceneView& scene, const ExactBox& exact,
                                    const typename PolicyCheck<P>::Storage& storage, Take&& take,
                                    const Visibility& visible = {}) {
  static_assert(P::kLevels == 0, "hiprt: ExactBox: through instances corners are rounded; use Box");
  FoundCount found;
  if (overlap_detail::is_refused<P>(scene)) return {0, TraversalState::kRefused};
  using LevelsOf = Levels<P::kLevels, P::kMoves, typename P::Real>;
  const auto visit = [&](const RegionTriangle& triangle, const LevelsOf&) HIPRT_FORCE_INLINE_LAMBDA {
    const Vec3 corner[3] = {Vec3(triangle.corner[0]), Vec3(triangle.corner[1]), Vec3(triangle.corner[2])};
    if (!box_meets_triangle(exact.box, corner)) return true;
    ++found.count;
    return take(BasicOverlap<0>{triangle.geometry, triangle.primitive, TraversalState::kHit});
  };
  found.state = overlap_detail::visit_convex<P>(scene, convex(exact.box), visible, storage, visit);
  return found;
}

/// The same for a sphere. The distance decides, and it is within its bound (docs/POINT_QUERIES.md).
template <class P = Policies, class Take>
HIPRT_HD inline FoundCount overlaps(const SceneView& scene, const SphereVolume& sphere,
                                    const typename PolicyCheck<P>::Storage& storage, Take&& take,
                                    const Visibility& visible = {}) {
  using Real = typename P::Real;
  using Result = ClosestPointOf<Real, P::kLevels>;
  const BasicPointQuery<Real> query{BasicVec3<Real>(sphere.center), static_cast<Real>(sphere.radius), visible.mask,
                                    visible.time};
  const auto visit = [&](const Result& point) HIPRT_FORCE_INLINE_LAMBDA {
    BasicOverlap<P::kLevels> overlap{point.geometry, point.primitive, TraversalState::kHit};
    if constexpr (P::kLevels != 0) overlap.path = point.path;
    return take(overlap);
  };
  return points_within<P, SplitPrimitives::kRepeat>(scene, query, storage, visit);
}

/// Whether any triangle touches or overlaps a volume.
/// @return one such triangle: which one depends on the tree.
template <class P = Policies, class Volume>
HIPRT_HD inline BasicOverlap<P::kLevels> any_overlap(const SceneView& scene, const Volume& volume,
                                                     const typename PolicyCheck<P>::Storage& storage,
                                                     const Visibility& visible = {}) {
  BasicOverlap<P::kLevels> first;
  const auto take = [&](const BasicOverlap<P::kLevels>& overlap) HIPRT_FORCE_INLINE_LAMBDA {
    first = overlap;
    return false;
  };
  first.state = overlaps<P>(scene, volume, storage, take, visible).state;
  return first;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
