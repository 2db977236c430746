// The traversal on the GPU of scenes whose instances hold triangles and move.

#include <tools/render/tracers/gpu_trace_rays.h>

namespace hiprt::tools {

template GpuTraceKernel find_kernel_of<OneMovingLevelKernels>(std::size_t, NodeLayout, Query, const TracePolicies&);

}  // namespace hiprt::tools
