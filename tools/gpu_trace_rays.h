#pragma once
/// The traversal on the GPU, in every combination of the policies that a user can choose, for one number of levels: a
/// template that gpu_kernels.hip and others of its name instantiate. For GPU compilers only.

#include "gpu_kernels.h"
#include "gpu_policies.h"
#include "instance_paths.h"
#include "trace_limits.h"

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
struct FlatPolicies : Policies<Layout, Triangle, Boxes, StackOfPolicy<kPolicy>> {
  using Schedule = WholeWave<kGpuPolicies[kPolicy].fetch_below>;
};

template <unsigned kLevels, bool kMoves, class Flat> struct PoliciesOfLevels { using Type = Instanced<Flat, kLevels>; };
template <unsigned kLevels, class Flat> struct PoliciesOfLevels<kLevels, true, Flat> {
  using Type = Moving<Instanced<Flat, kLevels>>;
};
template <class Flat> struct PoliciesOfLevels<0, false, Flat> { using Type = Flat; };

template <class Filter> __device__ HIPRT_INLINE Filter make_filter(const GpuTraceJob& job) {
  if constexpr (std::is_same_v<Filter, NoFilter>)
    return {};
  else
    return {job.holes};
}

constexpr unsigned least_resident(const GpuPolicy& policy, bool levels) {
  return levels ? policy.min_blocks_of_levels : policy.min_blocks;
}

/// @param storage of this lane's stack.
template <class Search, class Filter>
__device__ HIPRT_INLINE void trace_all(const GpuTraceJob& job, const typename Search::Storage& storage) {
  trace_batch(
      job.count, &job.counts->next_ray,
      [&](std::uint32_t i)
          HIPRT_INLINE_LAMBDA { return Search(job.scene, job.rays[i], storage, make_filter<Filter>(job)); },
      [&](std::uint32_t i, const Search& search) HIPRT_INLINE_LAMBDA {
        const auto hit = search.hit();
        job.hits[i] = hit;
        if constexpr (!std::is_same_v<typename Search::Answer, Hit>)
          if (job.paths != nullptr) store_path(hit, job.paths + std::size_t{i} * job.scene.levels, job.scene.levels);
      });
}

template <unsigned kLevels, bool kMoves, class Filter, std::size_t kPolicy, class Layout, class Triangle, class Boxes,
          Query kQuery>
__global__ void __launch_bounds__(kGpuPolicies[kPolicy].block,
                                  least_resident(kGpuPolicies[kPolicy], kLevels > 1 || kMoves))
    trace_rays(GpuTraceJob job) {
  using P = typename PoliciesOfLevels<kLevels, kMoves, FlatPolicies<kPolicy, Layout, Triangle, Boxes>>::Type;
  using Search = std::conditional_t<kQuery == Query::kClosest, ClosestHit<P, Filter>, AnyHit<P, Filter>>;
  if constexpr (kGpuPolicies[kPolicy].stack == GpuStack::kPrivate) {
    typename P::Stack::Memory memory;
    trace_all<Search, Filter>(job, {memory, &job.counts->overflowed_rays});
  } else {
    constexpr unsigned kBlock = kGpuPolicies[kPolicy].block;
    __shared__ StackEntry ring[kBlock * P::Stack::kEntriesPerThread];
    const Spill spill = grid_spill(job.spill, gridDim.x * kBlock, job.spill_entries, blockIdx.x * kBlock + threadIdx.x);
    const typename StackOfPolicy<kPolicy>::Storage stack(ring, threadIdx.x, kBlock, spill,
                                                         &job.counts->overflowed_rays);
    if constexpr (kLevels > 1) {
      LevelWays<kLevels> ways;
      trace_all<Search, Filter>(job, {stack, ways});
    } else {
      trace_all<Search, Filter>(job, stack);
    }
  }
}

template <unsigned kLevels, bool kMoves, class Filter, std::size_t kPolicy, class Layout, class Triangle, class Boxes>
GpuTraceKernel choose_query(Query query) {
  return query == Query::kClosest
             ? &trace_rays<kLevels, kMoves, Filter, kPolicy, Layout, Triangle, Boxes, Query::kClosest>
             : &trace_rays<kLevels, kMoves, Filter, kPolicy, Layout, Triangle, Boxes, Query::kAny>;
}

template <unsigned kLevels, bool kMoves, class Filter, std::size_t kPolicy, class Layout, class Triangle>
GpuTraceKernel choose_boxes(Query query, const TracePolicies& policies) {
  return policies.box_test == BoxTestKind::kConservative
             ? choose_query<kLevels, kMoves, Filter, kPolicy, Layout, Triangle, Conservative>(query)
             : choose_query<kLevels, kMoves, Filter, kPolicy, Layout, Triangle, Plain>(query);
}

template <unsigned kLevels, bool kMoves, class Filter, std::size_t kPolicy, class Layout>
GpuTraceKernel choose_triangle(Query query, const TracePolicies& policies) {
  if constexpr (kLevels > kGpuChoiceLevels || kMoves || !std::is_same_v<Filter, NoFilter>)
    return policies == TracePolicies{}
               ? choose_query<kLevels, kMoves, Filter, kPolicy, Layout, Watertight, Conservative>(query)
               : nullptr;
  else
    return policies.triangle_test == TriangleTestKind::kWatertight
               ? choose_boxes<kLevels, kMoves, Filter, kPolicy, Layout, Watertight>(query, policies)
               : choose_boxes<kLevels, kMoves, Filter, kPolicy, Layout, Fast>(query, policies);
}

/// Compiles nothing for policies of the other platform.
template <unsigned kLevels, bool kMoves, class Filter, std::size_t kPolicy>
GpuTraceKernel choose_layout(NodeLayout layout, Query query, const TracePolicies& policies) {
  constexpr GpuPolicy kThis = kGpuPolicies[kPolicy];
  if constexpr (kThis.architectures.starts_with(kPlatform)) {
    switch (layout) {
      case NodeLayout::kFloat:
        return choose_triangle<kLevels, kMoves, Filter, kPolicy, FloatLayout>(query, policies);
      case NodeLayout::kPlanes:
        return choose_triangle<kLevels, kMoves, Filter, kPolicy, PlanesLayout>(query, policies);
      case NodeLayout::kHalf:
        return choose_triangle<kLevels, kMoves, Filter, kPolicy, HalfLayout>(query, policies);
      case NodeLayout::kQuantized:
        return choose_triangle<kLevels, kMoves, Filter, kPolicy, QuantizedLayout>(query, policies);
    }
  }
  return nullptr;
}

template <unsigned kLevels, bool kMoves, class Filter, std::size_t... kIndices>
GpuTraceKernel choose_policy(std::index_sequence<kIndices...>, std::size_t policy, NodeLayout layout, Query query,
                             const TracePolicies& policies) {
  GpuTraceKernel kernel = nullptr;
  static_cast<void>(((kIndices == policy && (kernel = choose_layout<kLevels, kMoves, Filter, kIndices>(
                                                 layout, query, policies)) != nullptr) ||
                     ...));
  return kernel;
}

}  // namespace gpu_kernels

/// As find_trace_kernel(), for scenes of kLevels levels at most, which move only if kMoves.
/// @tparam Filter asked about hits; with the default tests only.
template <unsigned kLevels, bool kMoves = false, class Filter = NoFilter>
GpuTraceKernel find_kernel_of_levels(std::size_t policy, NodeLayout layout, Query query,
                                     const TracePolicies& policies) {
  return gpu_kernels::choose_policy<kLevels, kMoves, Filter>(std::make_index_sequence<kGpuPolicies.size()>(), policy,
                                                             layout, query, policies);
}

extern template GpuTraceKernel find_kernel_of_levels<0>(std::size_t, NodeLayout, Query, const TracePolicies&);
extern template GpuTraceKernel find_kernel_of_levels<1>(std::size_t, NodeLayout, Query, const TracePolicies&);
extern template GpuTraceKernel find_kernel_of_levels<kTraceLevels>(std::size_t, NodeLayout, Query,
                                                                   const TracePolicies&);
extern template GpuTraceKernel find_kernel_of_levels<kTraceLevels, true>(std::size_t, NodeLayout, Query,
                                                                         const TracePolicies&);

}  // namespace hiprt::tools
