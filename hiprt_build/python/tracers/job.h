#pragma once
/// What the tracers of one instruction set are asked to do. Plain members only: a container's inline function, compiled
/// for a newer instruction set, could be the copy that the linker keeps for the whole module.

#include <hiprt_device/ray.h>
#include <hiprt_device/scene_view.h>

#include <cstddef>
#include <cstdint>

namespace hiprt::python {

enum class Query { kClosest, kAny, kAll };

enum class Precision {
  kWatertight,
  kReference,  ///< Exact decisions.
  kFast,       ///< May miss at edges. Only flat scenes of triangles in layout planes have it; others are kWatertight.
  kDouble,     ///< RayD and HitD.
};

/// Most levels of instances that a scene may have.
inline constexpr unsigned kMostLevels = 32;
/// Most stack entries that a scene may need: 180 per tree of the builders, on all levels. A CPU touches only the memory
/// that a ray uses.
inline constexpr unsigned kMostEntries = 8192;

/// A hit of Query::kAll. Floats are exact in it.
struct ListedHit {
  double t, u, v;
  std::uint32_t geometry, primitive;
};

/// Receiver of results.
template <class Record> struct Sink {
  /// Takes a result of query @p query. It comes once per leaf that has it, in no particular order.
  /// @param path SceneView::levels numbers, as in TraceJob::paths.
  /// @return false: no more results are wanted, of any query.
  bool (*take)(void* to, std::size_t query, const Record& record, const std::uint32_t* path) = nullptr;
  void* to = nullptr;
};

struct TraceJob {
  const SceneView* scene;
  Query query;
  Precision precision;
  const void* rays;  ///< RayD for kDouble, else Ray.
  void* hits;        ///< HitD for kDouble, else Hit. Not for kAll.
  /// SceneView::levels numbers per ray: the instances of a hit, then kInvalidId. nullptr: paths are not stored.
  std::uint32_t* paths;
  std::size_t count;
  Sink<ListedHit> sink;  ///< For kAll only.
};

}  // namespace hiprt::python
