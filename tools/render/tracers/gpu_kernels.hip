// The traversal on the GPU of scenes without instances, and the choice of the smallest kernel that covers a scene.

#include <tools/render/tracers/gpu_trace_rays.h>

namespace hiprt::tools {

template GpuTraceKernel find_kernel_of<FlatKernels>(std::size_t, NodeLayout, Query, const TracePolicies&);

GpuTraceKernel find_trace_kernel(std::size_t policy, const SceneView& scene, Query query,
                                 const TracePolicies& policies) {
  const NodeLayout layout = scene.layout;
  if (scene.levels > kTraceLevels) return nullptr;
  const auto has = [&](Feature feature) { return (scene.features & feature_bit(feature)) != 0; };
  if (has(Feature::kCustom))
    return scene.levels == 0 ? find_kernel_of<FlatShapeKernels>(policy, layout, query, policies)
                             : find_kernel_of<ShapeKernels>(policy, layout, query, policies);
  if (has(Feature::kMotion))
    return scene.levels == 1 ? find_kernel_of<OneMovingLevelKernels>(policy, layout, query, policies)
                             : find_kernel_of<MovingKernels>(policy, layout, query, policies);
  if (scene.levels == 0) return find_kernel_of<FlatKernels>(policy, layout, query, policies);
  return scene.levels == 1 ? find_kernel_of<OneLevelKernels>(policy, layout, query, policies)
                           : find_kernel_of<LevelsKernels>(policy, layout, query, policies);
}

}  // namespace hiprt::tools
