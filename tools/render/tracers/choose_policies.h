#pragma once
/// Bodies of trace_levels() and trace_accurate(): they turn the choices of a job into template arguments, one after the
/// other, and run the loop. Sources that instantiate a tracer include it.

#include <tools/render/tracers/step_counter.h>
#include <tools/render/tracers/trace_kernels.h>
#include <tools/render/tracers/trace_loop.h>
#include <tools/render/tracers/trace_policies.h>

#include <hiprt_build/format/dispatch_layout.h>

#include <type_traits>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

template <unsigned kLevels, bool kMoves, class Layout, class Triangle, class Boxes>
void choose_counter(const TraceJob& job) {
  // Among the tracers of instances only the general one counts: it covers all scenes.
  if constexpr (kLevels == 0 || kMoves) {
    using Counting = std::conditional_t<kMoves, StepCounter, WorkCounter>;
    if (job.costs != nullptr)
      return trace_with<LevelPolicies<FlatPolicies<Layout, Triangle, Boxes, Counting>, kLevels, kMoves>>(job);
  }
  trace_with<LevelPolicies<FlatPolicies<Layout, Triangle, Boxes>, kLevels, kMoves>>(job);
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

template <unsigned kLevels, bool kMoves> void trace_levels(const TraceJob& job) {
  dispatch_layout(job.scene->layout, [&](auto layout) { choose_triangle<kLevels, kMoves, decltype(layout)>(job); });
}

template <unsigned kLevels, bool kMoves, class Triangle, class Primitives> void trace_accurate(const TraceJob& job) {
  dispatch_layout(job.scene->layout, [&](auto layout) {
    using Counter = std::conditional_t<kMoves, StepCounter, NoCounter>;
    using Flat = FlatPolicies<decltype(layout), Triangle, Conservative, Counter>;
    trace_with<LevelPolicies<Flat, kLevels, kMoves>, Primitives>(job);
  });
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
