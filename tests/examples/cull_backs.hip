#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

/// Rays see only the side of a triangle where its corners are counter-clockwise.
__global__ void trace_fronts(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  hiprt::PrivateStack<>::Memory memory;
  hits[i] = hiprt::ClosestHit<hiprt::Policies, hiprt::CullBackFaces>(scene, rays[i], memory).next_hit();
}
