#pragma once
/// The kernels of gpu_kernels*.hip, for C++ sources that launch them.

#include <tools/render/tracers/tracer.h>

#include <hiprt_device/traverse/stacks/stack.h>

#include <cstddef>
#include <cstdint>

namespace hiprt::tools {

/// Counters that all lanes of a launch share; zero at first.
struct GpuCounts {
  std::uint32_t next_ray;         ///< Index of the next ray to fetch.
  std::uint32_t overflowed_rays;  ///< Rays whose stack was too small.
};

/// The arguments of one launch. All pointers are device addresses.
struct GpuTraceJob {
  SceneView scene;
  const Ray* rays;
  Hit* hits;
  std::uint32_t count;
  std::uint32_t spill_entries;  ///< Per thread of the grid, in `spill` (grid_spill()); 0 for private stacks.
  StackEntry* spill;
  GpuCounts* counts;
  std::uint32_t* paths;           ///< scene.levels entries per ray. nullptr: paths are not stored.
  const PathScene* cutout_scene;  ///< For kernels with the filter AlphaCutout.
  /// The object and the instance, if the scene is one instance (PlacedObject). For find_placed_kernel().
  SceneView object;
  std::uint32_t instance;
};

using GpuTraceKernel = void (*)(GpuTraceJob job);

/// @param policy an index of kGpuPolicies.
/// @return the smallest kernel that covers the scene. nullptr if the policy is for another platform (AMD, NVIDIA) than
/// this build. nullptr also for tests other than the default ones, if kGpuChoiceLevels (trace_limits.h) excludes them.
GpuTraceKernel find_trace_kernel(std::size_t policy, const SceneView& scene, Query query,
                                 const TracePolicies& policies);

/// As find_trace_kernel(), for a scene that is one instance of an object with triangles, and the default policies.
/// @param object GpuTraceJob::object.
GpuTraceKernel find_placed_kernel(std::size_t policy, const SceneView& object, Query query);

/// As find_trace_kernel(), for kernels with the filter AlphaCutout and the default policies.
GpuTraceKernel find_alpha_cutout_kernel(std::size_t policy, const SceneView& scene, Query query);

}  // namespace hiprt::tools
