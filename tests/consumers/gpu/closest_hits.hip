#include <hiprt_device/hiprt_device.h>

#include <hip/hip_runtime.h>

__global__ void closest_hits(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = hiprt::closest_hit(scene, rays[i]);
}

void launch(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count) {
  if (count == 0) return;
  closest_hits<<<(count + 63) / 64, 64>>>(scene, rays, hits, count);
}
