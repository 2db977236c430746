#pragma once
/// Asks batches of points and boxes of a scene on the CPU, with the machine's best instruction set.
/// point_kernels_*.cpp compile the queries once per instruction set.

#include <tools/render/scene/trace_limits.h>

#include <hiprt_device/format/winding_tree.h>
#include <hiprt_device/query/closest_point.h>
#include <hiprt_device/scene_view.h>

#include <cstddef>
#include <cstdint>

namespace hiprt::tools {

/// Receiver of results. Plain members, for the reason that trace_job.h gives.
template <class Result> struct ResultSink {
  /// @param path scene.levels entries (instance_paths.h). @return false to stop.
  bool (*take)(void* to, std::size_t query, const Result& result, const std::uint32_t* path) = nullptr;
  void* to = nullptr;
};

/// Largest size of a result with a path, in bytes.
inline constexpr std::size_t kPathPointBytes = sizeof(PathClosestPoint<kTraceLevels>);

/// Closest points of triangles, spheres and curves.
struct PointJob {
  const SceneView* scene;
  const PointQuery* queries;
  std::size_t count;
  /// So many nearest ones of each query, each once, in order. 0: all within max_distance, in no order, and a
  /// triangle may come several times.
  std::uint32_t nearest;
  void* scratch;  ///< nearest * kPathPointBytes, aligned for any type.
  ResultSink<ClosestPoint> sink;
};

/// On which sides of closed surfaces points are.
struct SideJob {
  const SceneView* scene;
  const PointQuery* queries;
  std::size_t count;
  std::uint32_t* inside;       ///< 1: inside, 0: outside; one per query.
  const WindingTree* winding;  ///< Decides by winding numbers. nullptr: the crossings of a ray decide.
};

struct FoundOverlap {
  std::uint32_t geometry, primitive;
};

/// Triangles that touch boxes. A triangle may come several times.
struct OverlapJob {
  const SceneView* scene;
  const Box* boxes;
  std::size_t count;
  float time;
  ResultSink<FoundOverlap> sink;
};

/// Run a job on the calling thread.
/// @pre check_traceable() (bvh_file.h) accepts the scene's file. For the other two jobs check_triangles_only() does.
/// @return false: a stack was too small.
bool find(const PointJob& job);
bool find(const SideJob& job);
bool find(const OverlapJob& job);

}  // namespace hiprt::tools
