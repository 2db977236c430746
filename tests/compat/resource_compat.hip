// Kernels with HIPRT's names, as programs write them: no launch bounds. resources.json lists their registers and
// memory.

#include <hip/hip_runtime.h>
#include <hiprt/hiprt_device.h>

HIPRT_DEVICE bool intersectFunc(uint32_t, uint32_t, const hiprtFuncTableHeader& table, const hiprtRay& ray, void*,
                                hiprtHit& hit) {
  const auto* radius = static_cast<const float*>(table.funcDataSets[0].intersectFuncData);
  hit.t = -ray.origin.z / ray.direction.z;
  hit.normal = hiprtFloat3{0.0f, 0.0f, 1.0f};
  return hit.t > 0.0f && radius[hit.primID] > 0.0f;
}
HIPRT_DEVICE bool filterFunc(uint32_t, uint32_t, const hiprtFuncTableHeader&, const hiprtRay&, void*,
                             const hiprtHit& hit) {
  return hit.primID % 3u == 0u;
}

namespace hiprt::checks {

struct Job {
  void* object;
  hiprtFuncTable table;
  const hiprtRay* rays;
  hiprtHit* hits;
  uint32_t count;
  hiprtGlobalStackBuffer stack;
};

template <class Traversal> __global__ void geometry(Job job) {
  const uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= job.count) return;
  Traversal traversal(job.object, job.rays[i], hiprtTraversalHintDefault, nullptr, job.table);
  job.hits[i] = traversal.getNextHit();
}

template <class Traversal> __global__ void scene(Job job) {
  const uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= job.count) return;
  Traversal traversal(job.object, job.rays[i], hiprtFullRayMask, hiprtTraversalHintDefault, nullptr, job.table);
  job.hits[i] = traversal.getNextHit();
}

/// With a stack of HIPRT's, which is replaced.
template <class Traversal> __global__ void scene_with_stack(Job job) {
  const uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= job.count) return;
  hiprtGlobalStack stack(job.stack, hiprtSharedStackBuffer{0, nullptr});
  hiprtEmptyInstanceStack instances;
  Traversal traversal(job.object, job.rays[i], stack, instances, hiprtFullRayMask, hiprtTraversalHintDefault, nullptr,
                      job.table);
  job.hits[i] = traversal.getNextHit();
}

/// All hits of a ray: the traversal continues behind each.
__global__ void every_hit(Job job, uint32_t* counts) {
  const uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= job.count) return;
  hiprtSceneTraversalAnyHit traversal(job.object, job.rays[i]);
  uint32_t count = 0;
  while (traversal.getNextHit().hasHit()) ++count;
  counts[i] = count;
}

template __global__ void geometry<hiprtGeomTraversalClosest>(Job);
template __global__ void geometry<hiprtGeomTraversalAnyHit>(Job);
template __global__ void geometry<hiprtGeomCustomTraversalClosest>(Job);
template __global__ void geometry<hiprtGeomCustomTraversalAnyHit>(Job);
template __global__ void scene<hiprtSceneTraversalClosest>(Job);
template __global__ void scene<hiprtSceneTraversalAnyHit>(Job);
template __global__ void
    scene_with_stack<hiprtSceneTraversalClosestCustomStack<hiprtGlobalStack, hiprtEmptyInstanceStack>>(Job);

}  // namespace hiprt::checks
