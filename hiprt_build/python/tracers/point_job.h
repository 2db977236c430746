#pragma once
/// What the tracers of points and boxes of one instruction set are asked to do. Plain members only, as in job.h.

#include <hiprt_build/python/tracers/job.h>
#include <hiprt_device/query/overlaps.h>

#include <cstddef>
#include <cstdint>

namespace hiprt::python {

/// The closest point of a triangle, with the members of ClosestPointD.
struct ListedPoint {
  double distance_squared;
  BasicVec3<double> point;
  double u, v;
  std::uint32_t geometry, primitive;
  TriangleFeature feature;
};

/// Largest size of a result with a path, in bytes.
inline constexpr std::size_t kPathPointBytes = sizeof(BasicPathClosestPoint<double, kMostLevels>);

struct PointJob {
  const SceneView* scene;
  const PointQueryD* queries;
  std::size_t count;
  /// 0: all triangles within a query's max_distance, as Sink says. Else so many nearest ones, each once, in order.
  std::uint32_t nearest;
  void* scratch;  ///< nearest * kPathPointBytes, aligned for any type.
  Sink<ListedPoint> sink;
};

struct ListedOverlap {
  std::uint32_t geometry, primitive;
};

struct OverlapJob {
  const SceneView* scene;
  const Box* boxes;
  const Visibility* visible;  ///< One per box.
  std::size_t count;
  Sink<ListedOverlap> sink;
};

}  // namespace hiprt::python
