#pragma once
/// The kernels of gpu_kernels*.hip, for C++ sources that start them.

#include <tools/render/tracers/tracer.h>

#include <hiprt_device/traverse/stacks/stack.h>

#include <cstddef>
#include <cstdint>

namespace hiprt::tools {

/// What the lanes of one launch count together; zero at first.
struct GpuCounts {
  std::uint32_t next_ray;         ///< The first that no lane has taken.
  std::uint32_t overflowed_rays;  ///< Whose stack was too small.
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
  std::uint32_t* paths;           ///< scene.levels per ray; nullptr: nobody asks.
  const PathScene* cutout_scene;  ///< Of materials (CutOut), for kernels that ask.
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

/// The same of kernels for a scene that is one instance of an object with triangles, with the default policies.
/// @param object GpuTraceJob::object.
GpuTraceKernel find_placed_kernel(std::size_t policy, const SceneView& object, Query query);

/// The same of kernels for materials with holes, with the default policies.
GpuTraceKernel find_alpha_cutout_kernel(std::size_t policy, const SceneView& scene, Query query);

}  // namespace hiprt::tools
