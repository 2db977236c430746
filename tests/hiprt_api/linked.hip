// A kernel that is compiled ahead of time and linked by hiprtBuildTraceKernelsFromBitcode(), which adds the
// dispatchers.

#include <hip/hip_runtime.h>

#include <hiprt/impl/hiprt_device_impl.h>

__device__ bool linkedSphere(const hiprtRay&, const void* data, void*, hiprtHit& hit) {
  hit.t = 3.0f * *static_cast<const float*>(data);
  return true;
}
__device__ bool linkedNoFirst(const hiprtRay&, const void*, void*, const hiprtHit& hit) { return hit.primID == 0u; }

extern "C" __global__ void LinkedTrace(hiprtScene scene, hiprtFuncTable table, const hiprtRay* rays, hiprtHit* hits) {
  const uint32_t i = threadIdx.x;
  hiprtSceneTraversalClosest traversal(scene, rays[i], hiprtFullRayMask, hiprtTraversalHintDefault, nullptr, table);
  hits[i] = traversal.getNextHit();
}
