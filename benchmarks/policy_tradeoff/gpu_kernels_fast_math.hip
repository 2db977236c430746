// gpu_kernels.hip with fast-math. The headers refuse it without this definition.

#define HIPRT_ALLOW_FAST_MATH
#define HIPRT_TRADEOFF_KERNELS tradeoff_kernels_fast_math
#define HIPRT_TRADEOFF_SETS kFastMathSets
#define HIPRT_TRADEOFF_INSTANCED false
#include "gpu_kernels.hip"
