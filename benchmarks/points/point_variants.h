#pragma once
/// The point queries that bench_points measures, in one text for hosts and GPUs.

#include <hiprt_device/query/closest_point.h>
#include <hiprt_device/query/double_rays.h>
#include <hiprt_device/query/inside.h>
#include <hiprt_device/query/nearest_points.h>
#include <hiprt_device/query/overlaps.h>

namespace hiprt::bench {

/// kQuantized is kClosest in a file of that layout; all others are for the layout `planes`.
enum class PointVariant : unsigned { kClosest, kQuantized, kDouble, kNearest, kWithin, kSigned, kOverlap, kCount };

/// Points that kNearest finds.
inline constexpr std::uint32_t kNearestPoints = 8;

inline namespace HIPRT_ISA_NAMESPACE {

struct TakeAll {
  template <class Found> HIPRT_HD bool operator()(const Found&) const { return true; }
};

/// @param reach of kWithin: the radius; of kOverlap: the side of a cube around the point.
/// @return a squared distance, a number of triangles, or the signed distance (+inf: not known).
template <PointVariant kVariant> HIPRT_HD double ask(const SceneView& scene, const Vec3& point, float reach) {
  constexpr bool kIsQuantized = kVariant == PointVariant::kQuantized;
  using Tracer = std::conditional_t<kIsQuantized, WithLayout<QuantizedLayout>, Policies>;
  typename Tracer::Stack::Memory memory;
  const typename Tracer::Stack::Storage storage(memory);
  if constexpr (kVariant == PointVariant::kDouble) {
    using Precise = DoubleRays<Tracer>;
    return closest_point<Precise>(scene, {.point = BasicVec3<double>(point)}, storage).distance_squared;
  } else if constexpr (kVariant == PointVariant::kNearest) {
    ClosestPoint nearest[kNearestPoints];
    const FoundCount found = nearest_points<Tracer>(scene, {.point = point}, nearest, kNearestPoints, storage);
    return found.count == 0 ? 0.0 : nearest[found.count - 1].distance_squared;
  } else if constexpr (kVariant == PointVariant::kWithin) {
    return points_within<Tracer>(scene, {.point = point, .max_distance = reach}, storage, TakeAll{}).count;
  } else if constexpr (kVariant == PointVariant::kSigned) {
    const auto distance = static_cast<double>(signed_distance<Tracer>(scene, {.point = point}, storage).distance());
    return distance == distance ? distance : std::numeric_limits<double>::infinity();
  } else if constexpr (kVariant == PointVariant::kOverlap) {
    const float half = 0.5f * reach;
    const Box cube{{point.x - half, point.y - half, point.z - half}, {point.x + half, point.y + half, point.z + half}};
    return overlaps<Tracer>(scene, ExactBox{cube}, storage, TakeAll{}).count;
  } else {
    return closest_point<Tracer>(scene, {.point = point}, storage).distance_squared;
  }
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::bench
