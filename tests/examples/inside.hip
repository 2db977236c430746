// Whether points are inside closed meshes: by the number of times that a ray from each crosses the surface, which the
// triangle test Reference counts exactly, also through edges and corners.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

__global__ void find_inside(hiprt::SceneView scene, const hiprt::Vec3* points, bool* inside, unsigned count) {
  struct Tracer : hiprt::Policies {
    using Triangle = hiprt::Reference;
  };
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  Tracer::Stack::Memory memory;
  hiprt::AllHits<Tracer> query(scene, {.origin = points[i], .direction = hiprt::Vec3(0.0f, 0.0f, 1.0f)}, memory);
  unsigned crossings = 0;
  while (query.next_hit().found()) ++crossings;
  inside[i] = crossings % 2 == 1;
}
