/// The CPU's kernels, compiled once per HIPRT_TRADEOFF_COMPILER: usual, fast_math.

#include "kernels.h"
#include "tracer.h"

#define HIPRT_JOIN_EXPANDED(a, b) a##b
#define HIPRT_JOIN(a, b) HIPRT_JOIN_EXPANDED(a, b)
#define HIPRT_TRADEOFF_ASK HIPRT_JOIN(tradeoff_ask_, HIPRT_TRADEOFF_COMPILER)

namespace hiprt::bench {

void HIPRT_TRADEOFF_ASK(CpuWork& work);

namespace {

template <class Tracer> void ask_all(CpuWork& work) {
  const Probe& probe = *work.probe;
  const Tracer tracer{&probe.target.scene};
  if (probe.question == Question::kTrace) {
    for (std::uint64_t i = work.begin; i < work.end; ++i) probe.target.hits[i] = tracer.closest(probe.target.rays[i]);
    return;
  }
  for (std::uint64_t i = work.begin; i < work.end; ++i) {
    const Tally one = oracle::ask(probe, i, tracer);
    work.tally.skipped += one.skipped;
    work.tally.faults += one.faults;
    work.tally.lost += one.lost;
    work.tally.folded += one.folded;
  }
}

template <class Layout, class Triangle, class Boxes> void ask_set(CpuWork& work) {
  if (!work.placed) return ask_all<Tracer<Layout, Triangle, Boxes>>(work);
  if constexpr (!HIPRT_FAST_MATH && Layout::kId == NodeLayout::kPlanes)
    ask_all<Tracer<Layout, Triangle, Boxes, true>>(work);
}

}  // namespace

void HIPRT_TRADEOFF_ASK(CpuWork& work) {
  switch (work.set) {
#if HIPRT_FAST_MATH
#define HIPRT_POLICY_SET(number, name, triangle, boxes, layout)                   \
  case number:                                                                    \
    if constexpr (number < kFastMathSets) ask_set<layout, triangle, boxes>(work); \
    return;
#else
#define HIPRT_POLICY_SET(number, name, triangle, boxes, layout) \
  case number:                                                  \
    return ask_set<layout, triangle, boxes>(work);
#endif
    HIPRT_POLICY_SETS(HIPRT_POLICY_SET)
#undef HIPRT_POLICY_SET
    default:
      return;
  }
}

}  // namespace hiprt::bench
