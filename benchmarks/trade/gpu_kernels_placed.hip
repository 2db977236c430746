// gpu_kernels.hip for scenes of instances, which may move.

#define HIPRT_TRADEOFF_KERNELS tradeoff_kernels_placed
#define HIPRT_TRADEOFF_SETS std::size(kPolicySets)
#define HIPRT_TRADEOFF_PLACED true
#include "gpu_kernels.hip"
