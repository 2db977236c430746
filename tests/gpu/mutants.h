#pragma once
/// Closest hits of files of unknown origin on the host and on a GPU.

#include <hiprt_build/gpu/gpu.h>
#include <hiprt_device/ray.h>
#include <hiprt_device/scene_view.h>

#include <span>
#include <vector>

namespace hiprt::checks {

/// Most levels of instances of the files.
inline constexpr unsigned kMutantLevels = 2;
inline constexpr unsigned kMutantStack = 256;

/// Rays of one scene.
inline constexpr unsigned kMutantRays = 32;

struct MutantHit {
  Hit hit;
  std::uint32_t instance = kInvalidId;  ///< Of the scene's own instances.
};

/// @param scenes in layout kPlanes, without custom primitives, with or without instances, on the processor that traces.
/// @param rays kMutantRays of each scene. @return the hits of each ray.
std::vector<MutantHit> trace_mutants(std::span<const SceneView> scenes, std::span<const Ray> rays);
gpu::Result<std::vector<MutantHit>> trace_mutants_on_device(std::span<const SceneView> scenes,
                                                            std::span<const Ray> rays);

}  // namespace hiprt::checks
