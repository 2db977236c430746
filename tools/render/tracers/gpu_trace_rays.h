#pragma once
/// The GPU tracers: one template for all kinds of scenes and policies, which the sources gpu_kernels*.hip instantiate.
/// For GPU compilers only.

#include <tools/render/scene/path_surface.h>
#include <tools/render/scene/trace_limits.h>
#include <tools/render/tracers/gpu_kernels.h>
#include <tools/render/tracers/gpu_policies.h>

#include <hiprt_device/format/layout.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/intersect/exact_triangle_test.h>
#include <hiprt_device/primitives/scene_shapes.h>
#include <hiprt_device/query/batch.h>
#include <hiprt_device/traverse/hardware_policies.h>
#include <hiprt_device/traverse/stacks/rolling.h>

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

/// Of policies with private stacks. Custom primitives: 0.
template <class Kind> constexpr unsigned shared_entries(const GpuPolicy& policy) {
  if (!std::is_same_v<typename Kind::Primitives, NoPrimitives>) return 0;
  const SharedEntries& entries = policy.shared_entries;
  return Kind::kLevels == 0 ? entries.flat : Kind::kLevels == 1 ? entries.one_level : entries.levels;
}

template <unsigned kShared> struct PrivateOrTiered { using Stack = TieredStack<kShared, kGpuPrivateStack>; };
template <> struct PrivateOrTiered<0> { using Stack = PrivateStack<kGpuPrivateStack>; };

template <class Kind, std::size_t kPolicy>
using StackOfPolicy = std::conditional_t<kGpuPolicies[kPolicy].stack == GpuStack::kPrivate,
                                         typename PrivateOrTiered<shared_entries<Kind>(kGpuPolicies[kPolicy])>::Stack,
                                         RollingStack<kGpuRing>>;

template <class Kind> constexpr GpuSchedule schedule_of(const GpuPolicy& policy) {
  return Kind::kLevels > 1 && !Kind::kMoves ? policy.schedule_of_levels : policy.schedule;
}

template <GpuSchedule kSchedule> struct ScheduleOf {
  using Type = WholeWave<kSchedule.fetch_below, kSchedule.search_above>;
};
template <GpuSchedule kSchedule>
requires(kSchedule.fetch_below == 0) struct ScheduleOf<kSchedule> {
  using Type = Immediate;
};

/// Whether HIPRT_FEW_TRACE_KERNELS leaves out other layouts and tests than the default ones. Rolling stacks are for
/// trees that are deeper than those of the builders.
#if HIPRT_FEW_TRACE_KERNELS
constexpr bool is_rare(const GpuPolicy& policy) { return policy.stack == GpuStack::kRolling; }
#else
constexpr bool is_rare(const GpuPolicy&) { return false; }
#endif

constexpr bool by_instruction(const GpuPolicy& policy) { return policy.boxes == GpuBoxes::kRayInstruction; }

/// All policies except the levels.
template <class Kind, std::size_t kPolicy, class LayoutType, class TriangleType, class BoxesType>
struct FlatPolicies : std::conditional_t<by_instruction(kGpuPolicies[kPolicy]), HardwarePolicies, Policies> {
  using Layout = LayoutType;
  using Triangle = TriangleType;
  using Boxes = BoxesType;
  using Stack = StackOfPolicy<Kind, kPolicy>;
  using Schedule = typename ScheduleOf<schedule_of<Kind>(kGpuPolicies[kPolicy])>::Type;
};

template <unsigned kLevels, bool kMoves, class Flat> struct PoliciesOfLevels { using Type = Instanced<Flat, kLevels>; };
template <unsigned kLevels, class Flat> struct PoliciesOfLevels<kLevels, true, Flat> {
  using Type = Moving<Instanced<Flat, kLevels>>;
};
template <class Flat> struct PoliciesOfLevels<0, false, Flat> { using Type = Flat; };

template <class Filter> __device__ HIPRT_FORCE_INLINE Filter make_filter(const GpuTraceJob& job) {
  if constexpr (std::is_same_v<Filter, NoFilter>)
    return {};
  else
    return {job.cutout_scene};
}

template <class Primitives> __device__ HIPRT_FORCE_INLINE Primitives make_primitives(const SceneView& scene) {
  if constexpr (std::is_same_v<Primitives, NoPrimitives>)
    return {};
  else
    return Primitives(scene);
}

template <class Kind> constexpr unsigned least_resident(const GpuPolicy& policy) {
  const LeastResident& least = policy.least_resident;
  if (Kind::kMoves && std::is_same_v<typename Kind::Primitives, NoPrimitives>) return least.motion;
  return Kind::kLevels > 1 ? least.levels : least.one_level;
}

/// Calls use(storage) with the storage of this lane's stack, without the memory of the levels.
template <class Kind, std::size_t kPolicy, class Use>
__device__ HIPRT_FORCE_INLINE void with_stack(const GpuTraceJob& job, Use&& use) {
  using Stack = StackOfPolicy<Kind, kPolicy>;
  constexpr unsigned kBlock = kGpuPolicies[kPolicy].block;
  if constexpr (std::is_same_v<Stack, PrivateStack<kGpuPrivateStack>>) {
    typename Stack::Memory memory;
    use(typename Stack::Storage(memory, &job.counts->overflowed_rays));
  } else if constexpr (kGpuPolicies[kPolicy].stack == GpuStack::kPrivate) {
    __shared__ StackEntry entries[kBlock * Stack::kEntriesPerThread];
    typename Stack::Memory memory;
    use(typename Stack::Storage(entries, threadIdx.x, kBlock, memory, &job.counts->overflowed_rays));
  } else {
    __shared__ StackEntry ring[kBlock * Stack::kEntriesPerThread];
    const Spill spill = grid_spill(job.spill, gridDim.x * kBlock, job.spill_entries, blockIdx.x * kBlock + threadIdx.x);
    use(typename Stack::Storage(ring, threadIdx.x, kBlock, spill, &job.counts->overflowed_rays));
  }
}

/// Traces rays [0, count) with the lanes of a persistent grid. The parameters are those of trace_batch().
template <class Schedule, class Make, class Done>
__device__ HIPRT_FORCE_INLINE void trace_by_grid(const GpuTraceJob& job, Make&& make, Done&& done) {
  if constexpr (Schedule::kBatchOnly) {
    trace_batch(job.count, &job.counts->next_ray, make, done);
  } else {
    for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < job.count; i += gridDim.x * blockDim.x) {
      auto search = make(i);
      search.next_hit();
      done(i, search);
    }
  }
}

/// @param storage of this lane's stack.
template <class Search, class Schedule, Query kQuery>
__device__ HIPRT_FORCE_INLINE void trace_placed(const GpuTraceJob& job, const typename Search::Storage& storage) {
  const PlacedObject placed{job.scene, job.object, job.instance};
  trace_by_grid<Schedule>(
      job,
      [&](std::uint32_t i)
          HIPRT_FORCE_INLINE_LAMBDA { return Search(job.object, placed.to_object(job.rays[i]), storage); },
      [&](std::uint32_t i, const Search& search) HIPRT_FORCE_INLINE_LAMBDA {
        const auto hit =
            kQuery == Query::kClosest ? placed.to_scene(search.hit(), job.rays[i]) : placed.with_path(search.hit());
        job.hits[i] = hit;
        if (job.paths != nullptr) store_path(hit, job.paths + i, 1);
      });
}

/// @param storage of this lane's stack.
template <class Kind, class Search, class Schedule>
__device__ HIPRT_FORCE_INLINE void trace_all(const GpuTraceJob& job, const typename Search::Storage& storage) {
  trace_by_grid<Schedule>(
      job,
      [&](std::uint32_t i) HIPRT_FORCE_INLINE_LAMBDA {
        return Search(job.scene, job.rays[i], storage, make_filter<typename Kind::Filter>(job),
                      make_primitives<typename Kind::Primitives>(job.scene));
      },
      [&](std::uint32_t i, const Search& search) HIPRT_FORCE_INLINE_LAMBDA {
        const auto hit = search.hit();
        job.hits[i] = hit;
        if constexpr (!std::is_same_v<typename Search::Result, Hit>)
          if (job.paths != nullptr) store_path(hit, job.paths + std::size_t{i} * job.scene.levels, job.scene.levels);
      });
}

template <class Kind, std::size_t kPolicy, class Layout, class Triangle, class Boxes, Query kQuery>
__global__ void __launch_bounds__(kGpuPolicies[kPolicy].block, least_resident<Kind>(kGpuPolicies[kPolicy]))
    trace_rays(GpuTraceJob job) {
  // Only GPUs that have the instruction get such a kernel (fits()).
  if constexpr (kHasRayInstruction || !by_instruction(kGpuPolicies[kPolicy])) {
    using Flat = FlatPolicies<Kind, kPolicy, Layout, Triangle, Boxes>;
    using P = typename PoliciesOfLevels<Kind::kLevels, Kind::kMoves, Flat>::Type;
    using Schedule = typename P::Schedule;
    using Filter = typename Kind::Filter;
    using Primitives = typename Kind::Primitives;
    using Search =
        std::conditional_t<kQuery == Query::kClosest, ClosestHit<P, Filter, Primitives>, OneHit<P, Filter, Primitives>>;
    with_stack<Kind, kPolicy>(job, [&](const auto& stack) HIPRT_FORCE_INLINE_LAMBDA {
      if constexpr (Kind::kPlaced) {
        trace_placed<Search, Schedule, kQuery>(job, stack);
      } else if constexpr (Kind::kLevels == 1 && kGpuPolicies[kPolicy].shared_paths) {
        __shared__ PathMemory<1> path_memory[kGpuPolicies[kPolicy].block];
        trace_all<Kind, Search, Schedule>(job, {stack, path_memory[threadIdx.x]});
      } else if constexpr (Kind::kLevels != 0) {
        PathMemory<Kind::kLevels> path_memory;
        trace_all<Kind, Search, Schedule>(job, {stack, path_memory});
      } else {
        trace_all<Kind, Search, Schedule>(job, stack);
      }
    });
  }
}

template <class Kind, std::size_t kPolicy, class Layout, class Triangle, class Boxes>
GpuTraceKernel choose_query(Query query) {
  return query == Query::kClosest ? &trace_rays<Kind, kPolicy, Layout, Triangle, Boxes, Query::kClosest>
                                  : &trace_rays<Kind, kPolicy, Layout, Triangle, Boxes, Query::kAny>;
}

template <class Kind, std::size_t kPolicy, class Layout, class Triangle>
GpuTraceKernel choose_boxes(Query query, const TracePolicies& policies) {
  return policies.box_test == BoxTestKind::kConservative
             ? choose_query<Kind, kPolicy, Layout, Triangle, Conservative>(query)
             : choose_query<Kind, kPolicy, Layout, Triangle, Plain>(query);
}

template <class Kind, std::size_t kPolicy, class Layout>
GpuTraceKernel choose_triangle(Query query, const TracePolicies& policies) {
  if constexpr (Kind::kAllTests && !is_rare(kGpuPolicies[kPolicy])) {
    switch (policies.triangle_test) {
      case TriangleTestKind::kWatertight:
        return choose_boxes<Kind, kPolicy, Layout, Watertight>(query, policies);
      case TriangleTestKind::kFast:
        return choose_boxes<Kind, kPolicy, Layout, Fast>(query, policies);
      case TriangleTestKind::kReference:
        return policies.box_test == BoxTestKind::kConservative
                   ? choose_query<Kind, kPolicy, Layout, Reference, Conservative>(query)
                   : nullptr;
    }
  }
  return policies == TracePolicies{} ? choose_query<Kind, kPolicy, Layout, Watertight, Conservative>(query) : nullptr;
}

/// Of policies for the ray instruction.
template <class Kind, std::size_t kPolicy>
GpuTraceKernel choose_instruction(NodeLayout layout, Query query, const TracePolicies& policies) {
  if (policies != TracePolicies{}) return nullptr;
  if (layout == NodeLayout::kFloat) return choose_query<Kind, kPolicy, FloatLayout, Watertight, HardwareBoxes>(query);
  if (layout == NodeLayout::kHalf) return choose_query<Kind, kPolicy, HalfLayout, Watertight, HardwareBoxes>(query);
  return nullptr;
}

/// Whether there are kernels: not for policies of the other platform.
template <class Kind> constexpr bool is_compiled(const GpuPolicy& policy) {
  if (!policy.architectures.starts_with(kPlatform)) return false;
  // Files of instances do not have widened boxes.
  return !by_instruction(policy) || (Kind::kLevels == 0 && !Kind::kPlaced && Kind::kAllLayouts);
}

template <class Kind, std::size_t kPolicy>
GpuTraceKernel choose_layout(NodeLayout layout, Query query, const TracePolicies& policies) {
  if constexpr (!is_compiled<Kind>(kGpuPolicies[kPolicy])) {
    return nullptr;
  } else if constexpr (by_instruction(kGpuPolicies[kPolicy])) {
    return choose_instruction<Kind, kPolicy>(layout, query, policies);
  } else if constexpr (!Kind::kAllLayouts || is_rare(kGpuPolicies[kPolicy])) {
    return layout == NodeLayout::kPlanes ? choose_triangle<Kind, kPolicy, PlanesLayout>(query, policies) : nullptr;
  } else {
    switch (layout) {
      case NodeLayout::kFloat:
        return choose_triangle<Kind, kPolicy, FloatLayout>(query, policies);
      case NodeLayout::kPlanes:
        return choose_triangle<Kind, kPolicy, PlanesLayout>(query, policies);
      case NodeLayout::kHalf:
        return choose_triangle<Kind, kPolicy, HalfLayout>(query, policies);
      case NodeLayout::kQuantized:
        return choose_triangle<Kind, kPolicy, QuantizedLayout>(query, policies);
    }
  }
  return nullptr;
}

template <class Kind, std::size_t... kIndices>
GpuTraceKernel choose_policy(std::index_sequence<kIndices...>, std::size_t policy, NodeLayout layout, Query query,
                             const TracePolicies& policies) {
  GpuTraceKernel kernel = nullptr;
  static_cast<void>(
      ((kIndices == policy && (kernel = choose_layout<Kind, kIndices>(layout, query, policies)) != nullptr) || ...));
  return kernel;
}

}  // namespace gpu_kernels

/// What kernels are compiled for.
/// @tparam Asked about hits. @tparam Customs of the scene. @tparam kIsPlaced of a scene that is one instance: levels
/// are those of its object.
template <unsigned kMostLevels, bool kOfMotion = false, class Asked = NoFilter, class Customs = NoPrimitives,
          bool kIsPlaced = false>
struct KernelKind {
  static constexpr bool kPlaced = kIsPlaced;
  static constexpr unsigned kLevels = kMostLevels;
  static constexpr bool kMoves = kOfMotion;
  using Filter = Asked;
  using Primitives = Customs;
  /// Otherwise only PlanesLayout (HIPRT_FEW_TRACE_KERNELS).
#if HIPRT_FEW_TRACE_KERNELS
  static constexpr bool kAllLayouts =
      kLevels == 0 && !kPlaced && std::is_same_v<Filter, NoFilter> && std::is_same_v<Primitives, NoPrimitives>;
#else
  static constexpr bool kAllLayouts = true;
#endif
  /// Whether there are kernels of other tests than the default ones.
  static constexpr bool kAllTests = kLevels <= kGpuChoiceLevels && !kMoves && !kPlaced &&
                                    std::is_same_v<Filter, NoFilter> && std::is_same_v<Primitives, NoPrimitives>;
};

/// As find_trace_kernel(), of one kind.
template <class Kind>
GpuTraceKernel find_kernel_of(std::size_t policy, NodeLayout layout, Query query, const TracePolicies& policies) {
  return gpu_kernels::choose_policy<Kind>(std::make_index_sequence<kGpuPolicies.size()>(), policy, layout, query,
                                          policies);
}

using FlatKernels = KernelKind<0>;
using PlacedKernels = KernelKind<0, false, NoFilter, NoPrimitives, true>;
using OneLevelKernels = KernelKind<1>;
using LevelsKernels = KernelKind<kTraceLevels>;
using OneMovingLevelKernels = KernelKind<1, true>;
using MovingKernels = KernelKind<kTraceLevels, true>;
using FlatShapeKernels = KernelKind<0, false, NoFilter, SceneShapes>;
/// With or without alpha cut-outs: one kernel, because kernels compile slowly.
using ShapeKernels = KernelKind<kTraceLevels, true, AlphaCutout, SceneShapes>;

extern template GpuTraceKernel find_kernel_of<FlatKernels>(std::size_t, NodeLayout, Query, const TracePolicies&);
extern template GpuTraceKernel find_kernel_of<PlacedKernels>(std::size_t, NodeLayout, Query, const TracePolicies&);
extern template GpuTraceKernel find_kernel_of<OneLevelKernels>(std::size_t, NodeLayout, Query, const TracePolicies&);
extern template GpuTraceKernel find_kernel_of<LevelsKernels>(std::size_t, NodeLayout, Query, const TracePolicies&);
extern template GpuTraceKernel find_kernel_of<OneMovingLevelKernels>(std::size_t, NodeLayout, Query,
                                                                     const TracePolicies&);
extern template GpuTraceKernel find_kernel_of<MovingKernels>(std::size_t, NodeLayout, Query, const TracePolicies&);
extern template GpuTraceKernel find_kernel_of<FlatShapeKernels>(std::size_t, NodeLayout, Query, const TracePolicies&);
extern template GpuTraceKernel find_kernel_of<ShapeKernels>(std::size_t, NodeLayout, Query, const TracePolicies&);

}  // namespace hiprt::tools
