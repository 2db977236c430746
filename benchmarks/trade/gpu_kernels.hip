// The GPU's kernels as compilers compile by default. gpu_kernels_fast_math.hip is the same with fast-math,
// gpu_kernels_placed.hip for scenes of instances.

#include "gpu_kernels.h"
#include "tracer.h"

#include <hip/hip_runtime.h>

#if !defined(HIPRT_TRADEOFF_KERNELS)
#define HIPRT_TRADEOFF_KERNELS tradeoff_kernels_usual
#define HIPRT_TRADEOFF_SETS std::size(kPolicySets)
#define HIPRT_TRADEOFF_PLACED false
#endif

namespace hiprt::bench {

GpuKernels HIPRT_TRADEOFF_KERNELS(std::size_t set);

namespace {

constexpr bool kPlaced = HIPRT_TRADEOFF_PLACED;

template <class Layout, class Triangle, class Boxes> __global__ void ask_rays(GpuWork work) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= work.count) return;
  const Tally tally =
      oracle::ask(work.probe, work.first + i, Tracer<Layout, Triangle, Boxes, kPlaced>{&work.probe.target.scene});
  if (tally.skipped != 0) atomicAdd(work.tally, 1u);
  if (tally.faults != 0) atomicAdd(work.tally + 1, 1u);
  if (tally.lost != 0) atomicAdd(work.tally + 2, 1u);
  if (tally.folded != 0) atomicAdd(work.tally + 3, 1u);
}

/// Registers are left for as many waves of every policy set: without that those of the accurate ones are fewer.
template <class Layout, class Triangle, class Boxes>
__global__ void __launch_bounds__(kTraceBlock, least_resident(kPlaced)) trace_rays(GpuWork work) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= work.count) return;
  const Target& target = work.probe.target;
  target.hits[i] = Tracer<Layout, Triangle, Boxes, kPlaced>{&target.scene}.closest(target.rays[i]);
}

template <class Layout, class Triangle, class Boxes, std::size_t kNumber> GpuKernels kernels() {
  if constexpr (kNumber < HIPRT_TRADEOFF_SETS && (!kPlaced || Layout::kId == NodeLayout::kPlanes))
    return {&ask_rays<Layout, Triangle, Boxes>, &trace_rays<Layout, Triangle, Boxes>};
  else
    return {};
}

}  // namespace

GpuKernels HIPRT_TRADEOFF_KERNELS(std::size_t set) {
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
