#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

__global__ void closest_points(hiprt::SceneView scene, const hiprt::Vec3* points, float* distances, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) distances[i] = hiprt::closest_point(scene, points[i]).distance();
}
