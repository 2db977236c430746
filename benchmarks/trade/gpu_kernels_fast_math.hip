// gpu_kernels.hip with fast-math, which the headers take only if they are told so.

#define HIPRT_ALLOW_FAST_MATH
#define HIPRT_TRADEOFF_KERNELS tradeoff_kernels_fast_math
#define HIPRT_TRADEOFF_SETS kFastMathSets
#define HIPRT_TRADEOFF_PLACED false
#include "gpu_kernels.hip"
