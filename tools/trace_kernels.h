#pragma once
/// The traversal in every combination of the policies that a user can choose, for one number of levels: a template that
/// trace_kernels.cpp and others of its name instantiate, once per instruction set.

#include "instance_paths.h"
#include "trace_job.h"
#include "trace_limits.h"

#include <hiprt_device/format/layout.h>
#include <hiprt_device/hiprt_device.h>

#include <type_traits>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

template <class P> void trace_with(const TraceJob& job) {
  typename P::Stack::Memory stack;
  for (std::size_t i = 0; i < job.count; ++i) {
    typename P::Counter counter;
    const auto hit = job.query == Query::kClosest ? closest_hit<P>(*job.scene, job.rays[i], counter, stack)
                                                  : any_hit<P>(*job.scene, job.rays[i], counter, stack);
    job.hits[i] = hit;
    if constexpr (requires { counter.box_tests; })
      job.costs[i] = {counter.box_tests, counter.leaf_tests, counter.triangle_tests, counter.instance_tests};
    if constexpr (P::kLevels != 0)
      if (job.paths != nullptr) store_path(hit, job.paths + i * job.scene->levels, job.scene->levels);
  }
}

template <unsigned kLevels, bool kMoves, class Layout, class Triangle, class Boxes, class Counter>
void trace_counting(const TraceJob& job) {
  using Flat = Policies<Layout, Triangle, Boxes, PrivateStack<kTraceStack + kMostPushed>, DefaultLanes, Counter>;
  if constexpr (kLevels == 0)
    trace_with<Flat>(job);
  else if constexpr (kMoves)
    trace_with<Moving<Instanced<Flat, kLevels>>>(job);
  else
    trace_with<Instanced<Flat, kLevels>>(job);
}

template <unsigned kLevels, bool kMoves, class Layout, class Triangle, class Boxes>
void choose_counter(const TraceJob& job) {
  job.costs == nullptr ? trace_counting<kLevels, kMoves, Layout, Triangle, Boxes, NoCounter>(job)
                       : trace_counting<kLevels, kMoves, Layout, Triangle, Boxes, WorkCounter>(job);
}

template <unsigned kLevels, bool kMoves, class Layout, class Triangle> void choose_boxes(const TraceJob& job) {
  job.policies.box_test == BoxTestKind::kConservative
      ? choose_counter<kLevels, kMoves, Layout, Triangle, Conservative>(job)
      : choose_counter<kLevels, kMoves, Layout, Triangle, Plain>(job);
}

template <unsigned kLevels, bool kMoves, class Layout> void choose_triangle(const TraceJob& job) {
  job.policies.triangle_test == TriangleTestKind::kWatertight ? choose_boxes<kLevels, kMoves, Layout, Watertight>(job)
                                                              : choose_boxes<kLevels, kMoves, Layout, Fast>(job);
}

/// @pre the scene has kLevels levels at most, and moves only if kMoves.
template <unsigned kLevels, bool kMoves = false> void trace_levels(const TraceJob& job) {
  dispatch_layout(job.scene->layout, [&](auto layout) { choose_triangle<kLevels, kMoves, decltype(layout)>(job); });
}

extern template void trace_levels<0>(const TraceJob& job);
extern template void trace_levels<1>(const TraceJob& job);
extern template void trace_levels<kTraceLevels>(const TraceJob& job);
extern template void trace_levels<kTraceLevels, true>(const TraceJob& job);

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
