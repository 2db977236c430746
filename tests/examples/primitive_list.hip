// The closest of triangles, balls (CustomGeometry::type 0) and horizontal discs (type 1).

#include <hip/hip_runtime.h>
#include <hiprt_device/math/vec_functions.h>
#include "balls.h"

struct Discs {
  const Round* discs;
  template <class Report>
  HIPRT_HD bool intersect(const hiprt::Ray& ray, float, float, unsigned i, Report&& report) const {
    const float t = (discs[i].centre.z - ray.origin.z) / ray.direction.z;  // Parallel: NaN or infinite, no hit.
    const hiprt::Vec3 from = ray.origin + t * ray.direction - discs[i].centre;
    if (!(from.x * from.x + from.y * from.y <= discs[i].radius * discs[i].radius)) return true;
    return report(hiprt::CustomHit{t, from.x, from.y, hiprt::Vec3(0, 0, 1), 1e-6f * glm::length(ray.origin)});
  }
};

using Shapes = hiprt::PrimitiveList<Balls, Discs>;  // Custom types 0 and 1.

__global__ void trace_shapes(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count,
                             Shapes shapes) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  hiprt::PrivateStack<>::Memory memory;
  hiprt::ClosestHit<hiprt::Policies, hiprt::NoFilter, Shapes> query(scene, rays[i], memory, {}, shapes);
  hits[i] = query.next_hit();
}
