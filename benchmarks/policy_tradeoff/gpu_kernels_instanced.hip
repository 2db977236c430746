// gpu_kernels.hip for scenes of instances, which may move.

#define HIPRT_TRADEOFF_KERNELS tradeoff_kernels_instanced
#define HIPRT_TRADEOFF_SETS std::size(kPolicySets)
#define HIPRT_TRADEOFF_INSTANCED true
#include "gpu_kernels.hip"
