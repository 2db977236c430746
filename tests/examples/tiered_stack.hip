// A stack whose first entries are in shared memory, and the others in the thread's own: no memory of the host's.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

struct Tiered : hiprt::Policies {
  using Stack = hiprt::TieredStack<16>;
};
constexpr unsigned kTieredBlock = 64;

__global__ void trace_tiered(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count) {
  __shared__ hiprt::StackEntry entries[kTieredBlock * Tiered::Stack::kEntriesPerThread];
  Tiered::Stack::Memory memory;
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = hiprt::closest_hit<Tiered>(scene, rays[i], {entries, threadIdx.x, kTieredBlock, memory});
}
