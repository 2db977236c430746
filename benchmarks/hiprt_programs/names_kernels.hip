// Kernels as programs of HIPRT have them: no name of this library is in them but the job's.

#include "trace_job.h"

#include <hip/hip_runtime.h>
#include <hiprt/hiprt_device.h>

HIPRT_DEVICE bool intersectFunc(uint32_t, uint32_t, const hiprtFuncTableHeader&, const hiprtRay&, void*, hiprtHit&) {
  return false;
}
HIPRT_DEVICE bool filterFunc(uint32_t, uint32_t, const hiprtFuncTableHeader&, const hiprtRay&, void*, const hiprtHit&) {
  return false;
}

namespace hiprt::bench {
namespace {

/// Calls trace(ray) for the ray of this thread and writes its first hit.
template <class Trace> __device__ void trace_one(const NamesJob& job, const Trace& trace) {
  const uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= job.count) return;
  const hiprtHit hit = trace(job.rays[i]);
  job.results[i] = {hit.t, hit.primID};
}

template <class Traversal> __global__ void geometry_kernel(NamesJob job) {
  trace_one(job, [&](const hiprtRay& ray) {
    Traversal traversal(job.geometry, ray);
    return traversal.getNextHit();
  });
}

template <class Traversal> __global__ void scene_kernel(NamesJob job) {
  trace_one(job, [&](const hiprtRay& ray) {
    Traversal traversal(job.scene, ray);
    return traversal.getNextHit();
  });
}

template <class Traversal> __global__ void geometry_table_kernel(NamesJob job) {
  trace_one(job, [&](const hiprtRay& ray) {
    Traversal traversal(job.geometry, ray, hiprtTraversalHintDefault, nullptr, job.table);
    return traversal.getNextHit();
  });
}

template <class Traversal> __global__ void scene_table_kernel(NamesJob job) {
  trace_one(job, [&](const hiprtRay& ray) {
    Traversal traversal(job.scene, ray, hiprtFullRayMask, hiprtTraversalHintDefault, nullptr, job.table);
    return traversal.getNextHit();
  });
}

template <template <class> class Traversal> __global__ void geometry_stack_kernel(NamesJob job) {
  __shared__ int memory[kNamesBlock * kSharedEntries];
  trace_one(job, [&](const hiprtRay& ray) {
    hiprtGlobalStack stack(job.stack, hiprtSharedStackBuffer{kSharedEntries, memory});
    Traversal<hiprtGlobalStack> traversal(job.geometry, ray, stack);
    return traversal.getNextHit();
  });
}

template <template <class, class> class Traversal, class InstanceStack>
__global__ void scene_stack_kernel(NamesJob job) {
  __shared__ int memory[kNamesBlock * kSharedEntries];
  trace_one(job, [&](const hiprtRay& ray) {
    hiprtGlobalStack stack(job.stack, hiprtSharedStackBuffer{kSharedEntries, memory});
    const auto run = [&](InstanceStack& instances) {
      Traversal<hiprtGlobalStack, InstanceStack> traversal(job.scene, ray, stack, instances);
      return traversal.getNextHit();
    };
    if constexpr (std::is_same_v<InstanceStack, hiprtEmptyInstanceStack>) {
      InstanceStack instances;
      return run(instances);
    } else {
      InstanceStack instances(job.instance_stack, hiprtSharedStackBuffer{0, nullptr});
      return run(instances);
    }
  });
}

template <class Kernel> const void* address(Kernel* kernel) { return reinterpret_cast<const void*>(kernel); }

}  // namespace

std::span<const NamesKernel> names_kernels() {
  static const NamesKernel kernels[] = {
      {"GeomTraversalClosest", false, false, address(geometry_kernel<hiprtGeomTraversalClosest>)},
      {"GeomTraversalClosest, function table", false, false, address(geometry_table_kernel<hiprtGeomTraversalClosest>)},
      {"GeomTraversalClosest, global stack", false, false,
       address(geometry_stack_kernel<hiprtGeomTraversalClosestCustomStack>)},
      {"GeomCustomTraversalClosest", false, false, address(geometry_kernel<hiprtGeomCustomTraversalClosest>)},
      {"GeomTraversalAnyHit", false, true, address(geometry_kernel<hiprtGeomTraversalAnyHit>)},
      {"GeomTraversalAnyHit, function table", false, true, address(geometry_table_kernel<hiprtGeomTraversalAnyHit>)},
      {"GeomTraversalAnyHit, global stack", false, true,
       address(geometry_stack_kernel<hiprtGeomTraversalAnyHitCustomStack>)},
      {"SceneTraversalClosest", true, false, address(scene_kernel<hiprtSceneTraversalClosest>)},
      {"SceneTraversalClosest, function table", true, false, address(scene_table_kernel<hiprtSceneTraversalClosest>)},
      {"SceneTraversalClosest, global stacks", true, false,
       address(scene_stack_kernel<hiprtSceneTraversalClosestCustomStack, hiprtGlobalInstanceStack>)},
      {"SceneTraversalAnyHit", true, true, address(scene_kernel<hiprtSceneTraversalAnyHit>)},
      {"SceneTraversalAnyHit, function table", true, true, address(scene_table_kernel<hiprtSceneTraversalAnyHit>)},
      {"SceneTraversalAnyHit, global stack, empty instance stack", true, true,
       address(scene_stack_kernel<hiprtSceneTraversalAnyHitCustomStack, hiprtEmptyInstanceStack>)},
  };
  return kernels;
}

}  // namespace hiprt::bench
