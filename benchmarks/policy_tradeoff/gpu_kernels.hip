// The kernels for GPUs with the compiler's default settings. gpu_kernels_fast_math.hip compiles them with fast-math,
// gpu_kernels_instanced.hip for scenes of instances.

#include "kernels.h"
#include "tracer.h"

#include <hip/hip_runtime.h>

#if !defined(HIPRT_TRADEOFF_KERNELS)
#define HIPRT_TRADEOFF_KERNELS tradeoff_kernels_usual
#define HIPRT_TRADEOFF_SETS std::size(kPolicySets)
#define HIPRT_TRADEOFF_INSTANCED false
#endif

namespace hiprt::bench {

Kernels HIPRT_TRADEOFF_KERNELS(std::size_t set);

namespace {

constexpr bool kInstanced = HIPRT_TRADEOFF_INSTANCED;

template <class Layout, class Triangle, class Boxes> __global__ void check_rays(Work work) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= work.count) return;
  const Tally tally = oracle::check_ray(work.probe, work.first + i,
                                        Tracer<Layout, Triangle, Boxes, kInstanced>{&work.probe.target.scene});
  if (tally.skipped != 0) atomicAdd(work.tally, 1u);
  if (tally.faults != 0) atomicAdd(work.tally + 1, 1u);
  if (tally.lost != 0) atomicAdd(work.tally + 2, 1u);
  if (tally.folded != 0) atomicAdd(work.tally + 3, 1u);
}

/// The launch bounds give every policy set the same number of waves. Without them the accurate sets have fewer.
template <class Layout, class Triangle, class Boxes>
__global__ void __launch_bounds__(kTraceBlock, least_resident(kInstanced)) trace_rays(Work work) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= work.count) return;
  const Target& target = work.probe.target;
  target.hits[i] = Tracer<Layout, Triangle, Boxes, kInstanced>{&target.scene}.closest(target.rays[i]);
}

template <class Layout, class Triangle, class Boxes, std::size_t kNumber> Kernels kernels() {
  if constexpr (kNumber < HIPRT_TRADEOFF_SETS && (!kInstanced || Layout::kId == NodeLayout::kPlanes))
    return {{.gpu = reinterpret_cast<const void*>(&check_rays<Layout, Triangle, Boxes>), .block = kTraceBlock},
            {.gpu = reinterpret_cast<const void*>(&trace_rays<Layout, Triangle, Boxes>), .block = kTraceBlock}};
  else
    return {};
}

}  // namespace

Kernels HIPRT_TRADEOFF_KERNELS(std::size_t set) {
  switch (set) {
#define HIPRT_POLICY_SET(number, name, triangle, boxes, layout) \
  case number:                                                  \
    return kernels<layout, triangle, boxes, number>();
    HIPRT_POLICY_SETS(HIPRT_POLICY_SET)
#undef HIPRT_POLICY_SET
    default:
      return {};
  }
}

}  // namespace hiprt::bench
