#pragma once
/// The HIP runtime.

#include <hip/hip_runtime.h>

// AMD's headers define this word as nothing for compilers of the host. GCC 16's <format> uses it as an attribute.
#if !defined(__HIPCC__) && !defined(__CUDACC__)
#undef __noinline__
#endif
