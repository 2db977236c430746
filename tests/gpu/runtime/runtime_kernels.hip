#include <tests/gpu/kernels.h>

namespace hiprt::checks {

__global__ void write_indices(unsigned* out, unsigned first, unsigned count, unsigned* beyond) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count)
    out[i] = first + i;
  else
    atomicAdd(beyond, 1u);
}

__global__ void write_blocks(unsigned* out) {
  const unsigned block = blockIdx.y * gridDim.x + blockIdx.x;
  out[block * blockDim.x + threadIdx.x] = block;
}

__global__ void reverse_blocks(const unsigned* in, unsigned* out) {
  extern __shared__ unsigned values[];
  const unsigned first = blockIdx.x * blockDim.x;
  values[threadIdx.x] = in[first + threadIdx.x];
  __syncthreads();
  out[first + threadIdx.x] = values[blockDim.x - 1 - threadIdx.x];
}

__global__ void __launch_bounds__(kSmallBlock) small_blocks(unsigned* out) {
  out[blockIdx.x * blockDim.x + threadIdx.x] = blockIdx.x;
}

__global__ void write_scene_size(SceneView scene, std::uint64_t* size) { *size = scene.size; }

__global__ void nothing() {}

}  // namespace hiprt::checks
