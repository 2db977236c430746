// A kernel that writes one element past the end of an array: the tests *_asan_* must detect it.

#include <hiprt_build/gpu/gpu.h>

#include <cstdio>

__global__ void write_too_far(unsigned* out, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i <= count) out[i] = i;
}

int main() {
  constexpr unsigned kCount = 100;
  hiprt::gpu::DeviceAllocator allocator;
  auto out = hiprt::gpu::DeviceArray<unsigned>::make(kCount, nullptr, allocator);
  if (!out || !hiprt::gpu::launch(write_too_far, kCount + 1, nullptr, {}, out->data(), kCount) ||
      !out->to_vector(nullptr))
    return 1;
  std::puts("nobody noticed");
  return 0;
}
