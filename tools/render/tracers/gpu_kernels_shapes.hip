// The traversal on the GPU of scenes with spheres and curves.

#include <tools/render/tracers/gpu_trace_rays.h>

namespace hiprt::tools {

template GpuTraceKernel find_kernel_of<FlatShapeKernels>(std::size_t, NodeLayout, Query, const TracePolicies&);
template GpuTraceKernel find_kernel_of<ShapeKernels>(std::size_t, NodeLayout, Query, const TracePolicies&);

}  // namespace hiprt::tools
