#include <hiprt_device/hiprt_device.h>
#include <tests/gpu/kernels.h>

namespace hiprt::checks {

__global__ void closest_hits(SceneView scene, const Ray* rays, Hit* hits, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = closest_hit(scene, rays[i]);
}

__global__ void any_hits(SceneView scene, const Ray* rays, Hit* hits, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = any_hit(scene, rays[i]);
}

}  // namespace hiprt::checks
