// The closest hit in one call, whatever the scene's layout.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

__global__ void closest_hits(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = hiprt::closest_hit(scene, rays[i]);
}
