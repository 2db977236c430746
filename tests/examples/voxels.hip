#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

/// How many triangles touch each box; ~0u: not known.
__global__ void count_in_boxes(hiprt::SceneView scene, const hiprt::Box* boxes, unsigned* counts, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  struct Count {
    HIPRT_HD bool operator()(const hiprt::BasicOverlap<0>&) const { return true; }  // false would stop.
  };
  hiprt::PrivateStack<>::Memory memory;
  const hiprt::FoundCount found = hiprt::overlaps(scene, hiprt::ExactBox{boxes[i]}, memory, Count{});
  counts[i] = found.failed() ? ~0u : found.count;
}
