#pragma once
/// The part of HIP that the examples use, for the host. The threads of a grid run one after the other, in waves of one
/// lane.

#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <cstring>

// HIP's own names.
// NOLINTBEGIN(clang-diagnostic-reserved-identifier)
#define __global__ inline
#define __shared__ static
// NOLINTEND(clang-diagnostic-reserved-identifier)

struct dim3 {
  unsigned x = 1, y = 1, z = 1;
  constexpr explicit dim3(unsigned width = 1) : x(width) {}
};
inline dim3 gridDim, blockDim, blockIdx, threadIdx;

enum hipError_t { hipSuccess, hipErrorOutOfMemory };
enum hipMemcpyKind { hipMemcpyDeviceToHost };

template <class T> hipError_t hipMalloc(T** pointer, std::size_t bytes) {
  *pointer = static_cast<T*>(std::malloc(bytes + 1));
  return *pointer != nullptr ? hipSuccess : hipErrorOutOfMemory;
}
inline hipError_t hipFree(void* pointer) {
  std::free(pointer);
  return hipSuccess;
}
inline hipError_t hipMemset(void* to, int value, std::size_t bytes) {
  std::memset(to, value, bytes);
  return hipSuccess;
}
inline hipError_t hipMemcpy(void* to, const void* from, std::size_t bytes, hipMemcpyKind) {
  std::memcpy(to, from, bytes);
  return hipSuccess;
}
inline hipError_t hipGetLastError() { return hipSuccess; }

/// Calls thread() for every thread of the grid.
template <class Thread> void run_grid(const dim3& grid, const dim3& block, const Thread& thread) {
  gridDim = grid;
  blockDim = block;
  for (blockIdx.x = 0; blockIdx.x < grid.x; ++blockIdx.x)
    for (threadIdx.x = 0; threadIdx.x < block.x; ++threadIdx.x) thread();
}
#define hipLaunchKernelGGL(kernel, grid, block, shared_bytes, stream, ...) \
  run_grid(grid, block, [&] { (kernel)(__VA_ARGS__); })
