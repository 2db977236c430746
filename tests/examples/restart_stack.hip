// A stack without memory: four entries in registers, what falls off is found again from the root.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

struct Restarting : hiprt::Policies {
  using Stack = hiprt::RestartStack<4>;
};

__global__ void trace_restarting(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = hiprt::closest_hit<Restarting>(scene, rays[i], Restarting::Stack::Storage{});
}
