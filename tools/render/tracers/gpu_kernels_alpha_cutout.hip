// GPU tracers with the filter AlphaCutout.

#include <tools/render/tracers/gpu_trace_rays.h>

namespace hiprt::tools {

namespace {

GpuTraceKernel default_kernel(auto kind, std::size_t policy, const SceneView& scene, Query query) {
  return find_kernel_of<decltype(kind)>(policy, scene.layout, query, {});
}

}  // namespace

GpuTraceKernel find_alpha_cutout_kernel(std::size_t policy, const SceneView& scene, Query query) {
  if ((scene.features & feature_bit(Feature::kCustom)) != 0)
    return default_kernel(ShapeKernels{}, policy, scene, query);
  const bool moves = (scene.features & feature_bit(Feature::kMotion)) != 0;
  if (scene.levels == 0) return default_kernel(KernelKind<0, false, AlphaCutout>{}, policy, scene, query);
  if (scene.levels == 1 && !moves) return default_kernel(KernelKind<1, false, AlphaCutout>{}, policy, scene, query);
  if (scene.levels == 1) return default_kernel(KernelKind<1, true, AlphaCutout>{}, policy, scene, query);
  return default_kernel(KernelKind<kTraceLevels, true, AlphaCutout>{}, policy, scene, query);
}

}  // namespace hiprt::tools
