/// The traversal, compiled once per instruction set (HIPRT_ISA_NAME) in every combination of the policies that a user
/// can choose.

#include "trace_job.h"

#include <hiprt_device/format/layout.h>
#include <hiprt_device/hiprt_device.h>

#define HIPRT_JOIN_EXPANDED(a, b) a##b
#define HIPRT_JOIN(a, b) HIPRT_JOIN_EXPANDED(a, b)
#define HIPRT_TRACE HIPRT_JOIN(trace_, HIPRT_ISA_NAME)

namespace hiprt::tools {

void HIPRT_TRACE(const TraceJob& job);

namespace {

template <class Layout, class Triangle, class Boxes, class Counter> void run(const TraceJob& job) {
  using P = Policies<Layout, Triangle, Boxes, PrivateStack<kTraceStack>, DefaultLanes, Counter>;
  typename P::Stack::Memory stack;
  for (std::size_t i = 0; i < job.count; ++i) {
    Counter counter;
    if (job.query == Query::kClosest)
      job.hits[i] = closest_hit<P>(*job.scene, job.rays[i], counter, stack);
    else
      job.hits[i] = any_hit<P>(*job.scene, job.rays[i], counter, stack);
    if constexpr (requires { counter.box_tests; }) {
      job.costs[i].box_tests = counter.box_tests;
      job.costs[i].leaf_tests = counter.leaf_tests;
      job.costs[i].triangle_tests = counter.triangle_tests;
    }
  }
}

template <class Layout, class Triangle, class Boxes> void choose_counter(const TraceJob& job) {
  job.costs == nullptr ? run<Layout, Triangle, Boxes, NoCounter>(job) : run<Layout, Triangle, Boxes, WorkCounter>(job);
}

template <class Layout, class Triangle> void choose_boxes(const TraceJob& job) {
  job.policies.box_test == BoxTestKind::kConservative ? choose_counter<Layout, Triangle, Conservative>(job)
                                                      : choose_counter<Layout, Triangle, Plain>(job);
}

template <class Layout> void choose_triangle(const TraceJob& job) {
  job.policies.triangle_test == TriangleTestKind::kWatertight ? choose_boxes<Layout, Watertight>(job)
                                                              : choose_boxes<Layout, Fast>(job);
}

}  // namespace

void HIPRT_TRACE(const TraceJob& job) {
  dispatch_layout(job.scene->layout, [&](auto layout) { choose_triangle<decltype(layout)>(job); });
}

}  // namespace hiprt::tools
