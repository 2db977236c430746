// The host's part of rolling_stack.hip. Pointers are to device memory.

#include "rolling_stack.hip"

/// Returns how many rays' stacks were too small, whose hits then say failed(): 0 with these sizes.
unsigned launch_rolling(const hiprt::SceneView& scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count) {
  const unsigned blocks = (count + kRollingBlock - 1) / kRollingBlock;
  const unsigned entries = Rolling::Stack::spill_entries(scene.stack_bound);
  const size_t bytes = hiprt::grid_spill_bytes(size_t{blocks} * kRollingBlock, entries);
  hiprt::StackEntry* memory = nullptr;
  unsigned *overflows = nullptr, overflowed = ~0u;
  if (hipMalloc(&memory, bytes) == hipSuccess && hipMalloc(&overflows, sizeof(unsigned)) == hipSuccess &&
      hipMemset(overflows, 0, sizeof(unsigned)) == hipSuccess) {
    hipLaunchKernelGGL(trace_rolling, dim3(blocks), dim3(kRollingBlock), 0, nullptr, scene, rays, hits, count, memory,
                       entries, overflows);
    if (hipMemcpy(&overflowed, overflows, sizeof(unsigned), hipMemcpyDeviceToHost) != hipSuccess) overflowed = ~0u;
  }
  static_cast<void>(hipFree(overflows));
  static_cast<void>(hipFree(memory));
  return overflowed;
}
