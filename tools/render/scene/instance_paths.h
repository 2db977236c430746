#pragma once
/// Instance paths of a batch of hits, points or overlaps in one array.
///
/// Each path has SceneView::levels entries: the instances of InstancePath, then kInvalidId. Of a miss all are
/// kInvalidId.

#include <tools/render/scene/trace_limits.h>

#include <hiprt_device/instances/levels.h>

#include <cstdint>
#include <span>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

/// @tparam Found a result with a path: PathHit, PathClosestPoint, BasicOverlap.
/// @param to array of @p levels entries, at least as many as the path has.
template <class Found>
HIPRT_HD HIPRT_FORCE_INLINE void store_path(const Found& found, std::uint32_t* to, std::uint32_t levels) {
  const std::uint32_t depth = found.found() ? found.path.depth : 0;
  for (std::uint32_t k = 0; k < levels; ++k) to[k] = k < depth ? found.path.instance[k] : kInvalidId;
}

/// @param stored kTraceLevels numbers at most.
inline InstancePath<kTraceLevels> load_path(std::span<const std::uint32_t> stored) {
  InstancePath<kTraceLevels> path;
  for (const std::uint32_t instance : stored) {
    if (instance == kInvalidId) break;
    path.instance[path.depth++] = instance;
  }
  return path;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
