// A kernel of HIPRT: the closest hit of each ray in a scene, where a filter cuts holes into triangles.

#include <hip/hip_runtime.h>
#include <hiprt/hiprt_device.h>
#include <hiprt/hiprt_vec.h>

HIPRT_DEVICE bool intersectFunc(uint32_t, uint32_t, const hiprtFuncTableHeader&, const hiprtRay&, void*, hiprtHit&) {
  return false;  // No custom primitives.
}
HIPRT_DEVICE bool filterFunc(uint32_t geomType, uint32_t, const hiprtFuncTableHeader&, const hiprtRay&, void*,
                             const hiprtHit& hit) {
  return geomType == 0 && hit.uv.x + hit.uv.y < 0.1f;  // true: not a hit.
}

extern "C" __global__ void ClosestHits(hiprtScene scene, hiprtFuncTable table, const hiprtRay* rays, hiprtHit* hits,
                                       uint32_t count) {
  const uint32_t index = blockIdx.x * blockDim.x + threadIdx.x;
  if (index >= count) return;
  hiprtSceneTraversalClosest traversal(scene, rays[index], hiprtFullRayMask, hiprtTraversalHintDefault, nullptr, table);
  hits[index] = traversal.getNextHit();
}
