// The traversal on the GPU of scenes whose materials have holes.

#include "gpu_trace_rays.h"
#include "path_surface.h"

namespace hiprt::tools {

template GpuTraceKernel find_kernel_of_levels<0, false, CutOut>(std::size_t, NodeLayout, Query, const TracePolicies&);
template GpuTraceKernel find_kernel_of_levels<1, false, CutOut>(std::size_t, NodeLayout, Query, const TracePolicies&);
template GpuTraceKernel find_kernel_of_levels<kTraceLevels, true, CutOut>(std::size_t, NodeLayout, Query,
                                                                          const TracePolicies&);

GpuTraceKernel find_kernel_through_holes(std::size_t policy, const SceneView& scene, Query query) {
  const bool moves = (scene.features & feature_bit(Feature::kMotion)) != 0;
  if (scene.levels == 0) return find_kernel_of_levels<0, false, CutOut>(policy, scene.layout, query, {});
  if (scene.levels == 1 && !moves) return find_kernel_of_levels<1, false, CutOut>(policy, scene.layout, query, {});
  return find_kernel_of_levels<kTraceLevels, true, CutOut>(policy, scene.layout, query, {});
}

}  // namespace hiprt::tools
