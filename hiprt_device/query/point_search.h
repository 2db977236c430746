#pragma once
/// Points, and what is common to the queries around them: a traversal, masks and a filter.

#include <hiprt_device/intersect/point_triangle.h>
#include <hiprt_device/primitives/primitive_table.h>
#include <hiprt_device/query/query_core.h>
#include <hiprt_device/traverse/point_region.h>
#include <hiprt_device/traverse/policy_checks.h>
#include <hiprt_device/traverse/region.h>

namespace hiprt {

/// A point and the ball around it in which triangles and custom primitives count.
///
/// A query finds nothing if a coordinate is not finite, or max_distance is negative or NaN.
/// @tparam Real float; or double for policies whose Real is double.
template <class Real> struct BasicPointQuery {
  BasicVec3<Real> point{0};
  Real max_distance = std::numeric_limits<Real>::infinity();  ///< What is at this distance counts.
  std::uint32_t mask = 0xffffffffu;  ///< Geometries and instances with (mask & theirs) != 0 count.
  float time = 0.0f;                 ///< As Ray::time.
};
using PointQuery = BasicPointQuery<float>;
using PointQueryD = BasicPointQuery<double>;

/// The closest point of a triangle or a custom primitive.
///
/// Of those at the same squared distance the lowest path of instances comes first, then the lowest geometry, then
/// the lowest primitive. Triangles that share the closest vertex or edge have the same squared distance, bit by bit.
template <class Real> struct BasicClosestPoint {
  /// In double, so that no distance between floats is too small or too large for it. +inf: nothing was found. NaN: see
  /// failed().
  double distance_squared = std::numeric_limits<double>::infinity();
  BasicVec3<Real> point{0};  ///< In the scene, rounded to Real.
  Real u = 0;                ///< Weight of the triangle's corner 1; as Hit::u. The custom primitive's own.
  Real v = 0;                ///< Weight of the triangle's corner 2. The custom primitive's own.
  std::uint32_t geometry = kInvalidId;
  std::uint32_t primitive = kInvalidId;
  TriangleFeature feature = TriangleFeature::kFace;  ///< The part of the triangle. Custom: kFace.

  HIPRT_HD bool found() const { return primitive != kInvalidId; }
  /// Whether the query failed: it is not known what is closest. The stack was too small, or the policies do not cover
  /// the scene (covers()). Or the scene has custom primitives, and the query has no functors for them.
  HIPRT_HD bool failed() const { return distance_squared != distance_squared; }
  /// Rounded once. +inf: nothing was found.
  HIPRT_HD Real distance() const { return static_cast<Real>(square_root(distance_squared)); }
};
using ClosestPoint = BasicClosestPoint<float>;
using ClosestPointD = BasicClosestPoint<double>;

/// The same in a scene of instances. Geometry and primitive are those of the object at the end of the path.
template <class Real, unsigned kLevels> struct BasicPathClosestPoint : BasicClosestPoint<Real> {
  InstancePath<kLevels> path{};
};
template <unsigned kLevels> using PathClosestPoint = BasicPathClosestPoint<float, kLevels>;

/// The result of queries: a bare ClosestPoint for policies without levels.
template <class Real, unsigned kLevels>
using ClosestPointOf = std::conditional_t<kLevels == 0, BasicClosestPoint<Real>, BasicPathClosestPoint<Real, kLevels>>;

inline namespace HIPRT_ISA_NAMESPACE {

/// Whether @p a comes before @p b in the order of distance, path, geometry and primitive.
template <class Result> HIPRT_HD HIPRT_FORCE_INLINE bool precedes(const Result& a, const Result& b) {
  if (a.distance_squared != b.distance_squared) return a.distance_squared < b.distance_squared;
  if constexpr (requires { a.path; })
    if (!(a.path == b.path)) return a.path < b.path;
  return a.geometry != b.geometry ? a.geometry < b.geometry : a.primitive < b.primitive;
}

/// What is within a distance of a point. Internal: closest_point.h and nearest_points.h have the queries.
template <class P, class Filter, class Primitives> class PointSearch {
  static_assert(PolicyCheck<P>::kChecked);
  static_assert(DistanceSet<Primitives>,
                "hiprt: custom primitives of point queries must be a PrimitiveList, a TableRow or SceneShapes; see "
                "concept DistanceSet");
  using Real = typename P::Real;
  using Lanes = typename P::Lanes;

 public:
  using Storage = typename P::Stack::Storage;
  using Counter = typename P::Counter;
  using Query = BasicPointQuery<Real>;
  using Result = ClosestPointOf<Real, P::kLevels>;
  using Region = PointRegion<Lanes, P::kLevels>;

  HIPRT_HD HIPRT_FORCE_INLINE PointSearch(const SceneView& scene, const Query& query, const Storage& storage,
                                          const Filter& filter, const Primitives& primitives, const Counter& counter)
      : scene_(&scene), query_(query), storage_(storage), filter_(filter), primitives_(primitives), counter_(counter) {
    if (!is_covered()) state_ = TraversalState::kRefused;
  }

  /// Calls take(candidate, region) for each triangle and custom primitive within region.squared(), in no order. A
  /// triangle in several leaves comes several times. take() may shrink the region; it returns false to stop.
  template <class Take> HIPRT_HD HIPRT_FORCE_INLINE void run(Take&& take) {
    const Vec3D point(query_.point);
    const double farthest = static_cast<double>(query_.max_distance);
    Region region(*scene_, point, farthest * farthest);
    Traversal traversal(*scene_, is_valid() ? scene_->root : kInvalidRef, storage_);
    const BasicRay<Real> masked{.mask = query_.mask};
    const auto visit = [&](const RegionTriangle& triangle) HIPRT_FORCE_INLINE_LAMBDA {
      const TrianglePoint near = closest_on_triangle(triangle.corner, point);
      if (!(near.squared <= region.squared()) || !is_visible<P>(*scene_, traversal.levels(), masked, triangle.geometry))
        return true;
      return take(to_result(near, triangle, traversal.levels()), region);
    };
    if constexpr (kHasCustoms)
      traversal.run(*scene_, region, query_.mask, query_.time, counter_, visit,
                    [&](const RegionCustom& custom) HIPRT_FORCE_INLINE_LAMBDA {
                      if (!is_visible<P>(*scene_, traversal.levels(), masked, custom.geometry)) return true;
                      const TrianglePoint near = closest_on_custom(custom, traversal, region.in_object(query_.time));
                      const bool exists = near.squared < std::numeric_limits<double>::infinity();
                      if (!exists || !(near.squared <= region.squared())) return true;
                      return take(to_result(near, custom, traversal.levels()), region);
                    });
    else
      traversal.run(*scene_, region, query_.mask, query_.time, counter_, visit);
    overflowed_ = traversal.overflowed();
  }

  HIPRT_HD HIPRT_FORCE_INLINE FilterResult ask(const Result& candidate) const {
    if constexpr (std::is_same_v<Filter, NoFilter>)
      return FilterResult::kAccept;
    else
      return filter_(query_, candidate);
  }

  HIPRT_HD HIPRT_FORCE_INLINE bool can_go_on() const {
    return state_ == TraversalState::kInit || state_ == TraversalState::kHit;
  }
  HIPRT_HD HIPRT_FORCE_INLINE bool overflowed() const { return overflowed_; }
  HIPRT_HD HIPRT_FORCE_INLINE TraversalState state() const { return state_; }
  HIPRT_HD HIPRT_FORCE_INLINE const Counter& counter() const { return counter_; }

  HIPRT_HD HIPRT_FORCE_INLINE void conclude(bool found) {
    state_ = found ? TraversalState::kHit : overflowed_ ? TraversalState::kStackOverflow : TraversalState::kFinished;
    if constexpr (requires { storage_.on_overflow(); })
      if (state_ == TraversalState::kStackOverflow) storage_.on_overflow();
  }
  /// The result without a triangle: none, or a failure.
  HIPRT_HD HIPRT_FORCE_INLINE Result nothing() const {
    Result result;
    if (state_ == TraversalState::kStackOverflow || state_ == TraversalState::kRefused)
      result.distance_squared = std::numeric_limits<double>::quiet_NaN();
    return result;
  }

 private:
  using Traversal = RegionTraversal<P, typename P::ClosestOrder>;
  static constexpr bool kHasCustoms = Primitives::kCount != 0 && (P::kFeatures & feature_bit(Feature::kCustom)) != 0;

  HIPRT_HD HIPRT_FORCE_INLINE bool is_covered() const {
    if constexpr (requires { primitives_.covers(*scene_); })
      if (!primitives_.covers(*scene_)) return false;
    return covers<P>(*scene_) && (kHasCustoms || (scene_->features & feature_bit(Feature::kCustom)) == 0);
  }

  /// In the object.
  template <class Levels>
  HIPRT_HD HIPRT_FORCE_INLINE CustomPoint closest_in_object(const RegionCustom& custom, const Levels& levels,
                                                            const PointInObject& at) const {
    const PathPrimitiveId<Levels> id({custom.geometry, custom.primitive, levels.object_number(*scene_)}, *scene_,
                                     levels);
    return primitives_.closest(geometry_type(levels.geometry(*scene_, custom.geometry).flags), at, id);
  }

  /// In the scene. In instances the point is measured there, as a triangle's vertices are.
  HIPRT_HD HIPRT_FORCE_INLINE TrianglePoint closest_on_custom(const RegionCustom& custom, const Traversal& traversal,
                                                              const PointInObject& at) const {
    const CustomPoint near = closest_in_object(custom, traversal.levels(), at);
    TrianglePoint result{near.squared, near.point, near.u, near.v, TriangleFeature::kFace};
    if (traversal.placed().is_placed() && near.squared < std::numeric_limits<double>::infinity()) {
      result.point = traversal.placed().to_scene(near.point);
      const Vec3D from = Vec3D(query_.point) - result.point;
      result.squared = point_detail::dot(from, from);
    }
    return result;
  }
  HIPRT_HD HIPRT_FORCE_INLINE bool is_valid() const {
    const BasicVec3<Real>& p = query_.point;
    const Real zero = p.x * Real(0) + p.y * Real(0) + p.z * Real(0);
    return zero == Real(0) && query_.max_distance >= Real(0) && query_.time == query_.time;
  }

  /// @param found RegionTriangle or RegionCustom.
  template <class Found, class Levels>
  HIPRT_HD HIPRT_FORCE_INLINE static Result to_result(const TrianglePoint& near, const Found& found,
                                                      [[maybe_unused]] const Levels& levels) {
    Result result;
    result.distance_squared = near.squared;
    result.point = BasicVec3<Real>(near.point);
    result.u = static_cast<Real>(near.u);
    result.v = static_cast<Real>(near.v);
    result.geometry = found.geometry;
    result.primitive = found.primitive;
    result.feature = near.feature;
    if constexpr (P::kLevels != 0) result.path = levels.path();
    return result;
  }

  const SceneView* scene_;
  Query query_;
  Storage storage_;
  Filter filter_;
  [[no_unique_address]] Primitives primitives_;
  Counter counter_;
  TraversalState state_ = TraversalState::kInit;
  bool overflowed_ = false;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
