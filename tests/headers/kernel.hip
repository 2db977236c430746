// One kernel that traces a ray with the defaults, so that the device pass meets the whole traversal and not only the
// declarations of templates.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

__global__ void closest_hits(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = hiprt::closest_hit(scene, rays[i]);
}

__global__ void any_hits(hiprt::SceneView scene, const hiprt::Ray* rays, bool* hits, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = hiprt::any_hit(scene, rays[i]).found();
}

void launch(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, bool* any, unsigned count) {
  constexpr unsigned kBlock = 64;
  closest_hits<<<(count + kBlock - 1) / kBlock, kBlock>>>(scene, rays, hits, count);
  any_hits<<<(count + kBlock - 1) / kBlock, kBlock>>>(scene, rays, any, count);
}
