/// The kernels for CPUs, compiled once per HIPRT_TRADEOFF_COMPILER: usual, fast_math.

#include "check_range.h"
#include "tracer.h"

#define HIPRT_JOIN_EXPANDED(a, b) a##b
#define HIPRT_JOIN(a, b) HIPRT_JOIN_EXPANDED(a, b)
#define HIPRT_TRADEOFF_RUN HIPRT_JOIN(tradeoff_run_, HIPRT_TRADEOFF_COMPILER)

namespace hiprt::bench {

void HIPRT_TRADEOFF_RUN(const Work& work, std::uint64_t begin, std::uint64_t end);

namespace {

template <class Tracer> void run_range(const Work& work, std::uint64_t begin, std::uint64_t end) {
  const Probe& probe = work.probe;
  const Tracer tracer{&probe.target.scene};
  if (probe.kind != CheckKind::kTrace) return check_range(work, begin, end, tracer);
  for (std::uint64_t i = begin; i < end; ++i) probe.target.hits[i] = tracer.closest(probe.target.rays[i]);
}

template <class Layout, class Triangle, class Boxes>
void run_set(const Work& work, std::uint64_t begin, std::uint64_t end) {
  if (!work.instanced) return run_range<Tracer<Layout, Triangle, Boxes>>(work, begin, end);
  if constexpr (!HIPRT_FAST_MATH && Layout::kId == NodeLayout::kPlanes)
    run_range<Tracer<Layout, Triangle, Boxes, true>>(work, begin, end);
}

}  // namespace

void HIPRT_TRADEOFF_RUN(const Work& work, std::uint64_t begin, std::uint64_t end) {
  switch (work.set) {
#if HIPRT_FAST_MATH
#define HIPRT_POLICY_SET(number, name, triangle, boxes, layout)                               \
  case number:                                                                                \
    if constexpr (number < kFastMathSets) run_set<layout, triangle, boxes>(work, begin, end); \
    return;
#else
#define HIPRT_POLICY_SET(number, name, triangle, boxes, layout) \
  case number:                                                  \
    return run_set<layout, triangle, boxes>(work, begin, end);
#endif
    HIPRT_POLICY_SETS(HIPRT_POLICY_SET)
#undef HIPRT_POLICY_SET
    default:
      return;
  }
}

}  // namespace hiprt::bench
