// The traversal on the GPU of scenes that are one instance of an object with triangles.

#include <tools/render/tracers/gpu_trace_rays.h>

namespace hiprt::tools {

template GpuTraceKernel find_kernel_of<PlacedKernels>(std::size_t, NodeLayout, Query, const TracePolicies&);

GpuTraceKernel find_placed_kernel(std::size_t policy, const SceneView& object, Query query) {
  return find_kernel_of<PlacedKernels>(policy, object.layout, query, {});
}

}  // namespace hiprt::tools
