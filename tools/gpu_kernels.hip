// The traversal on the GPU of scenes without instances, and the choice of the smallest kernel that covers a scene.

#include "gpu_trace_rays.h"

namespace hiprt::tools {

template GpuTraceKernel find_kernel_of_levels<0>(std::size_t, NodeLayout, Query, const TracePolicies&);

GpuTraceKernel find_trace_kernel(std::size_t policy, NodeLayout layout, std::uint32_t levels, Query query,
                                 const TracePolicies& policies) {
  if (levels == 0) return find_kernel_of_levels<0>(policy, layout, query, policies);
  return levels <= kGpuTraceLevels ? find_kernel_of_levels<kGpuTraceLevels>(policy, layout, query, policies) : nullptr;
}

}  // namespace hiprt::tools
