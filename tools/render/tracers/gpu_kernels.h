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

/// One launch. All pointers are the device's.
struct GpuTraceJob {
  SceneView scene;
  const Ray* rays;
  Hit* hits;
  std::uint32_t count;
  std::uint32_t spill_entries;  ///< Per thread of the grid, at spill (grid_spill()); 0 for private stacks.
  StackEntry* spill;
  GpuCounts* counts;
  std::uint32_t* paths;           ///< scene.levels entries per ray. nullptr: paths are not stored.
  const PathScene* cutout_scene;  ///< For kernels with the filter AlphaCutout.
  /// Of a scene that is one instance (PlacedObject), for find_placed_kernel().
  SceneView object;
  std::uint32_t instance;
};

using GpuTraceKernel = void (*)(GpuTraceJob job);

/// @param policy an index of kGpuPolicies.
/// @return the smallest kernel that covers the scene; nullptr if this build's platform (AMD, NVIDIA) is not the
/// policy's, or for tests other than the default ones where kGpuChoiceLevels (trace_limits.h) says that there are none.
GpuTraceKernel find_trace_kernel(std::size_t policy, const SceneView& scene, Query query,
                                 const TracePolicies& policies);

/// As find_trace_kernel(), for a scene that is one instance of an object with triangles, and the default policies.
/// @param object GpuTraceJob::object.
GpuTraceKernel find_placed_kernel(std::size_t policy, const SceneView& object, Query query);

/// As find_trace_kernel(), for kernels with the filter AlphaCutout and the default policies.
GpuTraceKernel find_alpha_cutout_kernel(std::size_t policy, const SceneView& scene, Query query);

}  // namespace hiprt::tools
