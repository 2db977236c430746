// The traversal on the GPU, in every combination of the policies that a user can choose.

#include "gpu_kernels.h"

#include "gpu_policies.h"

#include <hiprt_device/batch.h>
#include <hiprt_device/format/layout.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/stacks/rolling.h>

#include <type_traits>
#include <utility>

namespace hiprt::tools {
/// Not an anonymous namespace: a kernel has one name in both passes of the compiler.
namespace gpu_kernels {

#if defined(__CUDACC__)
constexpr std::string_view kPlatform = "sm_";
#else
constexpr std::string_view kPlatform = "gfx";
#endif

template <std::size_t kPolicy>
using StackOfPolicy = std::conditional_t<kGpuPolicies[kPolicy].stack == GpuStack::kPrivate,
                                         PrivateStack<kGpuPrivateStack>, RollingStack<kGpuRing>>;

template <std::size_t kPolicy, class Layout, class Triangle, class Boxes>
struct GpuPolicies : Policies<Layout, Triangle, Boxes, StackOfPolicy<kPolicy>> {
  using Schedule = WholeWave<kGpuPolicies[kPolicy].fetch_below>;
};

/// @param storage of this lane's stack.
template <class Search>
__device__ HIPRT_INLINE void trace_all(const GpuTraceJob& job, const typename Search::Storage& storage) {
  trace_batch(
      job.count, &job.counts->next_ray,
      [&](std::uint32_t i) HIPRT_INLINE_LAMBDA { return Search(job.scene, job.rays[i], storage); },
      [&](std::uint32_t i, const Search& search) HIPRT_INLINE_LAMBDA { job.hits[i] = search.hit(); });
}

template <std::size_t kPolicy, class Layout, class Triangle, class Boxes, Query kQuery>
__global__ void __launch_bounds__(kGpuPolicies[kPolicy].block, kGpuPolicies[kPolicy].min_blocks)
    trace_rays(GpuTraceJob job) {
  using P = GpuPolicies<kPolicy, Layout, Triangle, Boxes>;
  using Search = std::conditional_t<kQuery == Query::kClosest, ClosestHit<P>, AnyHit<P>>;
  if constexpr (kGpuPolicies[kPolicy].stack == GpuStack::kPrivate) {
    typename P::Stack::Memory memory;
    trace_all<Search>(job, {memory, &job.counts->overflowed_rays});
  } else {
    constexpr unsigned kBlock = kGpuPolicies[kPolicy].block;
    __shared__ StackEntry ring[kBlock * P::Stack::kEntriesPerThread];
    const Spill spill = grid_spill(job.spill, gridDim.x * kBlock, job.spill_entries, blockIdx.x * kBlock + threadIdx.x);
    trace_all<Search>(job, {ring, threadIdx.x, kBlock, spill, &job.counts->overflowed_rays});
  }
}

template <std::size_t kPolicy, class Layout, class Triangle, class Boxes> GpuTraceKernel choose_query(Query query) {
  return query == Query::kClosest ? &trace_rays<kPolicy, Layout, Triangle, Boxes, Query::kClosest>
                                  : &trace_rays<kPolicy, Layout, Triangle, Boxes, Query::kAny>;
}

template <std::size_t kPolicy, class Layout, class Triangle>
GpuTraceKernel choose_boxes(Query query, const TracePolicies& policies) {
  return policies.box_test == BoxTestKind::kConservative ? choose_query<kPolicy, Layout, Triangle, Conservative>(query)
                                                         : choose_query<kPolicy, Layout, Triangle, Plain>(query);
}

template <std::size_t kPolicy, class Layout>
GpuTraceKernel choose_triangle(Query query, const TracePolicies& policies) {
  return policies.triangle_test == TriangleTestKind::kWatertight
             ? choose_boxes<kPolicy, Layout, Watertight>(query, policies)
             : choose_boxes<kPolicy, Layout, Fast>(query, policies);
}

/// Compiles nothing for policies of the other platform.
template <std::size_t kPolicy>
GpuTraceKernel choose_layout(NodeLayout layout, Query query, const TracePolicies& policies) {
  if constexpr (kGpuPolicies[kPolicy].architectures.starts_with(kPlatform)) {
    switch (layout) {
      case NodeLayout::kFloat:
        return choose_triangle<kPolicy, FloatLayout>(query, policies);
      case NodeLayout::kPlanes:
        return choose_triangle<kPolicy, PlanesLayout>(query, policies);
      case NodeLayout::kHalf:
        return choose_triangle<kPolicy, HalfLayout>(query, policies);
      case NodeLayout::kQuantized:
        return choose_triangle<kPolicy, QuantizedLayout>(query, policies);
    }
  }
  return nullptr;
}

template <std::size_t... kIndices>
GpuTraceKernel choose_policy(std::index_sequence<kIndices...>, std::size_t policy, NodeLayout layout, Query query,
                             const TracePolicies& policies) {
  GpuTraceKernel kernel = nullptr;
  static_cast<void>(
      ((kIndices == policy && (kernel = choose_layout<kIndices>(layout, query, policies)) != nullptr) || ...));
  return kernel;
}

}  // namespace gpu_kernels

GpuTraceKernel find_trace_kernel(std::size_t policy, NodeLayout layout, Query query, const TracePolicies& policies) {
  return gpu_kernels::choose_policy(std::make_index_sequence<kGpuPolicies.size()>(), policy, layout, query, policies);
}

}  // namespace hiprt::tools
