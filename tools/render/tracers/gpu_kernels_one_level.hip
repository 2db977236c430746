// The traversal on the GPU of scenes whose instances hold triangles.

#include <tools/render/tracers/gpu_trace_rays.h>

namespace hiprt::tools {

template GpuTraceKernel find_kernel_of<OneLevelKernels>(std::size_t, NodeLayout, Query, const TracePolicies&);

}  // namespace hiprt::tools
