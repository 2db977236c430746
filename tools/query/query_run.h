#pragma once
/// Asks every point, sphere or box of a batch of a scene, on several threads.

#include <tools/base/names.h>
#include <tools/base/parallel.h>
#include <tools/scene_io/query_file.h>

#include <hiprt_build/error.h>
#include <hiprt_device/format/winding_tree.h>
#include <hiprt_device/scene_view.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

namespace hiprt::tools {

enum class QueryKind {
  kClosest,     ///< The closest point.
  kSigned,      ///< The same with a distance that is negative inside.
  kNearest,     ///< The k nearest triangles.
  kWithin,      ///< All triangles within the distance.
  kInside,      ///< Whether a point is inside.
  kOverlaps,    ///< All triangles that touch.
  kAnyOverlap,  ///< One triangle that touches.
};

/// What decides on which side of a surface a point is.
enum class SignKind { kCrossings, kWinding };

inline constexpr Names<SignKind, 2> kSignKinds{{{"crossings", SignKind::kCrossings}, {"winding", SignKind::kWinding}}};

inline constexpr Names<QueryKind, 7> kQueryKinds{{{"closest", QueryKind::kClosest},
                                                  {"signed", QueryKind::kSigned},
                                                  {"nearest", QueryKind::kNearest},
                                                  {"within", QueryKind::kWithin},
                                                  {"inside", QueryKind::kInside},
                                                  {"overlaps", QueryKind::kOverlaps},
                                                  {"any-overlap", QueryKind::kAnyOverlap}}};

/// Whether the elements of a shape can be asked so. Spheres are points with a largest distance of their own.
constexpr bool can_ask(QueryShape shape, QueryKind kind) {
  const bool overlaps = kind == QueryKind::kOverlaps || kind == QueryKind::kAnyOverlap;
  return shape == QueryShape::kSphere ? kind != QueryKind::kInside : overlaps == (shape == QueryShape::kBox);
}
/// Whether spheres and curves of a file cannot be asked so: they have no inside, and overlaps are those of triangles.
constexpr bool needs_triangles(QueryKind kind) {
  return kind != QueryKind::kClosest && kind != QueryKind::kNearest && kind != QueryKind::kWithin;
}
/// Whether the results are lists, of any length.
constexpr bool has_lists(QueryKind kind) { return kind == QueryKind::kWithin || kind == QueryKind::kOverlaps; }
/// Whether the results are points; else they are numbers.
constexpr bool has_points(QueryKind kind) {
  return kind != QueryKind::kInside && kind != QueryKind::kOverlaps && kind != QueryKind::kAnyOverlap;
}

struct QueryWork {
  const SceneView& scene;
  const QueryBatch& batch;
  QueryKind kind;
  std::uint32_t nearest = 1;                                    ///< k of kNearest.
  float max_distance = std::numeric_limits<float>::infinity();  ///< Of points.
  float time = 0.0f;
  /// Decides the sides of kSigned and kInside. nullptr: the crossings of a ray do.
  const WindingTree* winding = nullptr;
};

/// The records of a result file (query_file.h).
struct QueryResults {
  std::uint32_t each = 1;              ///< Records per query. 0: see `first`.
  std::vector<std::uint64_t> first;    ///< Of lists: the first record of each query, and the end.
  std::vector<PointRecord> points;     ///< If has_points(kind).
  std::vector<std::uint32_t> numbers;  ///< Else: primitives or sides.
  std::vector<std::uint32_t> paths;    ///< scene.levels per record (instance_paths.h); empty for kInside.
  std::size_t found = 0;               ///< Queries that found something, or points that are inside.

  std::size_t records() const { return points.size() + numbers.size(); }
};

/// @pre can_ask(work.batch.shape, work.kind), and the preconditions of find() (point_tracer.h).
/// @param progress receives the finished fraction.
/// @return the same results for any number of threads. kCancelled after interrupted().
build::Result<QueryResults> run_queries(const QueryWork& work, const ThreadLimit& limit,
                                        const std::function<void(double)>& progress);

}  // namespace hiprt::tools
