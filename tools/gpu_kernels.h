#pragma once
/// The kernels of gpu_kernels*.hip, for C++ sources that start them.

#include "tracer.h"

#include <hiprt_device/stack.h>

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
  std::uint32_t* paths;  ///< scene.levels per ray; nullptr: nobody asks.
};

using GpuTraceKernel = void (*)(GpuTraceJob job);

/// @param policy an index of kGpuPolicies.
/// @param levels of the scene.
/// @return the smallest kernel that covers the scene; nullptr if this build's platform (AMD, NVIDIA) is not the
/// policy's, or levels is above kGpuTraceLevels.
GpuTraceKernel find_trace_kernel(std::size_t policy, NodeLayout layout, std::uint32_t levels, Query query,
                                 const TracePolicies& policies);

}  // namespace hiprt::tools
