#pragma once
/// Whether a point is inside closed surfaces, and the distance to them with a sign.

#include <hiprt_device/intersect/exact_triangle_test.h>
#include <hiprt_device/query/hit_lists.h>
#include <hiprt_device/query/side.h>

namespace hiprt {

/// The closest point of a surface, and the side on which the query's point is.
/// @tparam Nearest ClosestPoint or PathClosestPoint.
template <class Nearest> struct SignedDistance {
  Nearest nearest;
  Side side = Side::kUnknown;

  /// Negative inside. +-inf: nothing within max_distance. NaN: see failed().
  HIPRT_HD auto distance() const {
    const auto length = failed() ? nearest.distance() * std::numeric_limits<float>::quiet_NaN() : nearest.distance();
    return side == Side::kInside ? -length : length;
  }
  HIPRT_HD bool failed() const { return nearest.failed() || side == Side::kUnknown; }
};

inline namespace HIPRT_ISA_NAMESPACE {

namespace inside_detail {

template <class P> struct Parity : P {
  static_assert(std::is_same_v<typename P::Real, float>, "hiprt: is_inside() and signed_distance() need Real = float");
  using Triangle = Reference;
  static constexpr bool kSurface = false;
};

}  // namespace inside_detail

/// Whether a point is inside the closed surfaces of a scene: whether a ray from it crosses them an odd number of times.
///
/// Reference decides each crossing exactly, also through edges and vertices. So for closed meshes the result is right
/// for every point that is not on the surface; there it is either. In instances the ray counts as it was rounded.
/// A point inside two overlapping meshes counts as outside. For open meshes the result depends on where the holes are.
/// A point that is not finite is outside.
/// @param query max_distance is not used.
/// @param storage of the traversal's stack; one query at a time may use it.
template <class P>
HIPRT_HD inline Side is_inside(const SceneView& scene, const BasicPointQuery<typename PolicyCheck<P>::Real>& query,
                               const typename PolicyCheck<P>::Storage& storage) {
  using Tracer = inside_detail::Parity<P>;
  Ray ray;
  ray.origin = query.point;
  ray.mask = query.mask;
  ray.time = query.time;
  const FoundCount crossings = count_hits<Tracer>(scene, ray, storage);
  if (crossings.failed()) return Side::kUnknown;
  return crossings.count % 2 == 0 ? Side::kOutside : Side::kInside;
}

/// The closest point of closed surfaces, and on which side the query's point is.
template <class P>
HIPRT_HD inline auto signed_distance(const SceneView& scene,
                                     const BasicPointQuery<typename PolicyCheck<P>::Real>& query,
                                     const typename PolicyCheck<P>::Storage& storage) {
  SignedDistance<ClosestPointOf<typename P::Real, P::kLevels>> result;
  result.nearest = closest_point<P>(scene, query, storage);
  result.side = is_inside<P>(scene, query, storage);
  return result;
}

/// The same with a stack of the function's own.
template <class P>
HIPRT_HD inline Side is_inside(const SceneView& scene, const BasicPointQuery<typename PolicyCheck<P>::Real>& query) {
  static_assert(OwnedStack<typename P::Stack>, "hiprt: this stack needs storage: pass it after the query");
  typename P::Stack::Memory memory;
  return is_inside<P>(scene, query, typename P::Stack::Storage(memory));
}
template <class P>
HIPRT_HD inline auto signed_distance(const SceneView& scene,
                                     const BasicPointQuery<typename PolicyCheck<P>::Real>& query) {
  static_assert(OwnedStack<typename P::Stack>, "hiprt: this stack needs storage: pass it after the query");
  typename P::Stack::Memory memory;
  return signed_distance<P>(scene, query, typename P::Stack::Storage(memory));
}

namespace query_detail {
struct SideInLayout {
  const SceneView& scene;
  const PointQuery& query;
  template <class Layout> HIPRT_HD Side operator()(Layout) const { return is_inside<WithLayout<Layout>>(scene, query); }
};
struct SignedInLayout {
  const SceneView& scene;
  const PointQuery& query;
  template <class Layout> HIPRT_HD SignedDistance<ClosestPoint> operator()(Layout) const {
    return signed_distance<WithLayout<Layout>>(scene, query);
  }
};
}  // namespace query_detail

/// The same with the default policies, for a scene of any layout without instances.
template <class Default = void>
requires std::same_as<Default, void> HIPRT_HD inline Side is_inside(const SceneView& scene, const Vec3& point) {
  return query_detail::with_layout(scene, query_detail::SideInLayout{scene, PointQuery{point}});
}
template <class Default = void>
requires std::same_as<Default, void> HIPRT_HD inline SignedDistance<ClosestPoint> signed_distance(
    const SceneView& scene, const Vec3& point) {
  return query_detail::with_layout(scene, query_detail::SignedInLayout{scene, PointQuery{point}});
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
