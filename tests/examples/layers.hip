// A closest-hit query that goes on: the first three layers of what a ray passes through.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

constexpr unsigned kLayers = 3;

/// found[i]: how many of ray i's layers[kLayers * i + 0, 1, 2] there are, nearest first; ~0u: not known.
__global__ void first_layers(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* layers, unsigned* found,
                             unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  hiprt::PrivateStack<>::Memory memory;
  hiprt::ClosestHit<> query(scene, rays[i], memory);
  unsigned layer = 0;
  for (; layer < kLayers; ++layer) {
    const hiprt::Hit hit = query.next_hit();  // Behind the last one.
    if (query.state() != hiprt::TraversalState::kHit) break;
    layers[kLayers * i + layer] = hit;
  }
  const bool ended = query.state() == hiprt::TraversalState::kFinished;  // Fewer than kLayers.
  found[i] = layer == kLayers || ended ? layer : ~0u;
}
