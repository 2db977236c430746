// The traversal on the GPU of scenes without instances, and the choice of the smallest kernel that covers a scene.

#include "gpu_trace_rays.h"

namespace hiprt::tools {

template GpuTraceKernel find_kernel_of_levels<0>(std::size_t, NodeLayout, Query, const TracePolicies&);

GpuTraceKernel find_trace_kernel(std::size_t policy, const SceneView& scene, Query query,
                                 const TracePolicies& policies) {
  const NodeLayout layout = scene.layout;
  if (scene.levels > kTraceLevels) return nullptr;
  if ((scene.features & feature_bit(Feature::kMotion)) != 0)
    return find_kernel_of_levels<kTraceLevels, true>(policy, layout, query, policies);
  if (scene.levels == 0) return find_kernel_of_levels<0>(policy, layout, query, policies);
  return scene.levels == 1 ? find_kernel_of_levels<1>(policy, layout, query, policies)
                           : find_kernel_of_levels<kTraceLevels>(policy, layout, query, policies);
}

}  // namespace hiprt::tools
