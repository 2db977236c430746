// Every hit of a ray: how much light comes through panes that each let a part of it pass.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

__global__ void transmittance(hiprt::SceneView scene, const hiprt::Ray* rays, const float* passes_geometry,
                              float* light, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  hiprt::PrivateStack<>::Memory memory;
  hiprt::AllHits<> query(scene, rays[i], memory);
  float passes = 1.0f;
  for (hiprt::Hit hit = query.next_hit(); hit.found(); hit = query.next_hit()) passes *= passes_geometry[hit.geometry];
  light[i] = query.state() == hiprt::TraversalState::kFinished ? passes : -1.0f;  // -1: not all were found.
}
