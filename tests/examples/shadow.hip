// Shadow rays: from the surfaces that rays have hit to a light.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

using Shadows = hiprt::Policies;

__global__ void shadows(hiprt::SceneView scene, const hiprt::Ray* rays, const hiprt::Hit* hits, hiprt::Vec3 light,
                        bool* lit, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  lit[i] = false;
  if (!hits[i].found()) return;
  const hiprt::Vec3 point = rays[i].origin + hits[i].t * rays[i].direction;
  hiprt::Ray shadow;
  shadow.origin = hiprt::spawn_origin(rays[i], hits[i], light - point);
  shadow.direction = light - shadow.origin;
  shadow.tmax = 1.0f;  // In units of the direction: the light.
  const hiprt::Hit blocker = hiprt::any_hit<Shadows>(scene, shadow);
  lit[i] = !blocker.found() && !blocker.failed();
}
