// Stacks in global memory, in slots that waves take while they run: memory for the waves that run at a time, however
// many rays there are.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

struct Global : hiprt::Policies {
  using Stack = hiprt::GlobalStack;
};

__global__ void trace_global(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count,
                             hiprt::SpillPool pool) {
  const hiprt::WaveSlot slot(pool, blockIdx.x);  // All lanes of the wave together, here and at the end.
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = hiprt::closest_hit<Global>(scene, rays[i], Global::Stack::Storage(slot.spill()));
}

/// Bytes of SpillPool::memory; SpillPool::locks has a word per slot, zero at first. wave: lanes of the device's waves.
size_t global_stack_bytes(const hiprt::SceneView& scene, unsigned slots, unsigned wave, unsigned& entries) {
  entries = scene.stack_bound + hiprt::kMostPushed;
  return hiprt::pool_spill_bytes(slots, entries, wave);
}
