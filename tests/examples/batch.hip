// Persistent waves: a grid that fills the device, whose lanes take rays until there are no more.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

struct Batch : hiprt::Policies {
  using Stack = hiprt::SharedStack<24>;
  using Schedule = hiprt::WholeWave<>;  // WholeWave<12, 4>.
};
constexpr unsigned kBatchBlock = 64;

/// next: 0 at first. overflows: rays whose stack was too small; their hits say failed().
__global__ void trace_persistent(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count,
                                 unsigned* next, unsigned* overflows) {
  __shared__ hiprt::StackEntry entries[kBatchBlock * Batch::Stack::kEntriesPerThread];
  const Batch::Stack::Storage stack(entries, threadIdx.x, kBatchBlock, overflows);
  hiprt::trace_batch(
      count, next, [&](unsigned i) { return hiprt::ClosestHit<Batch>(scene, rays[i], stack); },
      [&](unsigned i, const hiprt::ClosestHit<Batch>& query) { hits[i] = query.hit(); });
}
