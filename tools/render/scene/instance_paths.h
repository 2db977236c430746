#pragma once
/// Ways through a scene's instances as a batch of rays has them: one after the other, each with room for the longest.
///
/// A way is SceneView::levels numbers, those of InstancePath; behind its end there is kInvalidId, as there is in all of
/// a miss.

#include <tools/render/scene/trace_limits.h>

#include <hiprt_device/instances/levels.h>

#include <cstdint>
#include <span>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

/// @param to room for @p levels numbers, at least as many as the way has.
template <unsigned kLevels>
HIPRT_HD HIPRT_INLINE void store_path(const PathHit<kLevels>& hit, std::uint32_t* to, std::uint32_t levels) {
  const std::uint32_t depth = hit.found() ? hit.path.depth : 0;
  for (std::uint32_t k = 0; k < levels; ++k) to[k] = k < depth ? hit.path.instance[k] : kInvalidId;
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
