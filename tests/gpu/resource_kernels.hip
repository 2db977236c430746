// Small kernels whose registers and memory resources.json lists.

#include <hip/hip_runtime.h>

namespace hiprt::checks {

/// Nothing but registers.
__global__ void weighted_sum(const float* a, const float* b, float weight, float* sum, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) sum[i] = a[i] + weight * b[i];
}

/// 1024 bytes of shared memory.
__global__ void block_maximum(const float* values, float* maximum) {
  __shared__ float largest[256];
  largest[threadIdx.x] = values[blockIdx.x * 256 + threadIdx.x];
  for (unsigned step = 128; step != 0; step /= 2) {
    __syncthreads();
    if (threadIdx.x < step) largest[threadIdx.x] = fmaxf(largest[threadIdx.x], largest[threadIdx.x + step]);
  }
  if (threadIdx.x == 0) maximum[blockIdx.x] = largest[0];
}

/// An array that is indexed at run time, and so lies in the thread's own memory.
template <unsigned kSize> __global__ void follow(const unsigned* next, unsigned* last, unsigned steps) {
  unsigned visited[kSize] = {};
  unsigned at = threadIdx.x % kSize;
  for (unsigned i = 0; i < steps; ++i) {
    ++visited[at];
    at = next[visited[at] + at] % kSize;
  }
  last[blockIdx.x * blockDim.x + threadIdx.x] = visited[at];
}

template __global__ void follow<64>(const unsigned*, unsigned*, unsigned);

}  // namespace hiprt::checks
