// A query with a rolling stack: a ring in shared memory over global memory that is sized for the scene.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

struct Rolling : hiprt::Policies {
  using Stack = hiprt::RollingStack<8>;
  using Schedule = hiprt::Postponed;
};
constexpr unsigned kRollingBlock = 64;

__global__ void trace_rolling(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count,
                              hiprt::StackEntry* memory, unsigned entries, unsigned* overflows) {
  __shared__ hiprt::StackEntry ring[kRollingBlock * Rolling::Stack::kEntriesPerThread];
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  const hiprt::Spill spill = hiprt::grid_spill(memory, gridDim.x * kRollingBlock, entries, i);
  hiprt::ClosestHit<Rolling> query(scene, rays[i], {ring, threadIdx.x, kRollingBlock, spill, overflows});
  hits[i] = query.next_hit();
}
