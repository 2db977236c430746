// The library's spheres and round curves as custom primitives.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/primitives/round_curve.h>
#include <hiprt_device/primitives/sphere.h>

using SpheresAndCurves = hiprt::PrimitiveList<hiprt::SphereSet, hiprt::RoundCurveSet>;  // Custom types 0 and 1.

__global__ void trace_spheres_and_curves(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits,
                                         unsigned count, SpheresAndCurves primitives) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  hiprt::PrivateStack<>::Memory memory;
  hiprt::ClosestHit<hiprt::Policies, hiprt::NoFilter, SpheresAndCurves> query(scene, rays[i], memory, {}, primitives);
  hits[i] = query.next_hit();
}
