/// The traversal, compiled once per instruction set (HIPRT_ISA_NAME) in the combinations of policies that are compared.

#include "kernel.h"

#include <hiprt_device/format/layout.h>
#include <hiprt_device/hiprt_device.h>

#define HIPRT_JOIN_EXPANDED(a, b) a##b
#define HIPRT_JOIN(a, b) HIPRT_JOIN_EXPANDED(a, b)
#define HIPRT_BENCH_TRACE HIPRT_JOIN(bench_trace_, HIPRT_ISA_NAME)

namespace hiprt::bench {

void HIPRT_BENCH_TRACE(const KernelJob& job);

namespace {

template <class P, bool kAnyHit> void run(const KernelJob& job) {
  typename P::Stack::Memory stack;
  for (std::size_t i = 0; i < job.count; ++i) {
    typename P::Counter counter;
    if constexpr (kAnyHit)
      job.hits[i] = any_hit<P>(*job.scene, job.rays[i], counter, stack);
    else
      job.hits[i] = closest_hit<P>(*job.scene, job.rays[i], counter, stack);
    if constexpr (requires { counter.box_tests; }) {
      job.work->box_tests += counter.box_tests;
      job.work->leaf_tests += counter.leaf_tests;
    }
  }
}

template <class P> void choose_query(const KernelJob& job) { job.any_hit ? run<P, true>(job) : run<P, false>(job); }

template <class LayoutType, class TriangleType, class BoxesType, class CounterType> struct Variant : Policies {
  using Layout = LayoutType;
  using Triangle = TriangleType;
  using Boxes = BoxesType;
  using Counter = CounterType;
};
struct InArrays : Policies {
  using Lanes = ArrayLanes;
};

template <class Layout, class Triangle, class Boxes> void choose_counter(const KernelJob& job) {
  job.work == nullptr ? choose_query<Variant<Layout, Triangle, Boxes, NoCounter>>(job)
                      : choose_query<Variant<Layout, Triangle, Boxes, WorkCounter>>(job);
}

struct Exact : Policies {
  using Triangle = Reference;
};

template <class Layout> void choose_tests(const KernelJob& job) {
  job.tests == Tests::kAccurate ? choose_counter<Layout, Watertight, Conservative>(job)
                                : choose_counter<Layout, Fast, Plain>(job);
}

}  // namespace

void HIPRT_BENCH_TRACE(const KernelJob& job) {
  if (job.lanes == Lanes::kArray)
    choose_query<InArrays>(job);
  else if (job.tests == Tests::kReference)
    choose_query<Exact>(job);
  else
    job.scene->layout == NodeLayout::kFloat ? choose_tests<FloatLayout>(job) : choose_tests<PlanesLayout>(job);
}

}  // namespace hiprt::bench
