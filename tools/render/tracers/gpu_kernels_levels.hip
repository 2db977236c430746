// The traversal on the GPU of scenes of more than one level of instances.

#include <tools/render/tracers/gpu_trace_rays.h>

namespace hiprt::tools {

template GpuTraceKernel find_kernel_of<LevelsKernels>(std::size_t, NodeLayout, Query, const TracePolicies&);

}  // namespace hiprt::tools
