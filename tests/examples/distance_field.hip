#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

/// distances: of the cells' centers, negative inside; NaN: not known.
__global__ void distance_field(hiprt::SceneView scene, hiprt::Vec3 first, float step, unsigned side, float* distances) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= side * side * side) return;
  const hiprt::Vec3 cell(static_cast<float>(i % side), static_cast<float>(i / side % side),
                         static_cast<float>(i / side / side));
  distances[i] = hiprt::signed_distance(scene, first + step * cell).distance();
}
