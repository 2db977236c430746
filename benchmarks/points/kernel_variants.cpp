/// Point queries, compiled once per instruction set (HIPRT_ISA_NAME).

#include "kernel.h"
#include "point_variants.h"

#define HIPRT_JOIN_EXPANDED(a, b) a##b
#define HIPRT_JOIN_NAMES(a, b) HIPRT_JOIN_EXPANDED(a, b)
#define HIPRT_BENCH_POINTS HIPRT_JOIN_NAMES(bench_points_, HIPRT_ISA_NAME)

namespace hiprt::bench {
namespace {

template <unsigned kVariant = 0> void run(const PointJob& job) {
  constexpr auto kThis = static_cast<PointVariant>(kVariant);
  if constexpr (kThis != PointVariant::kCount) {
    if (job.variant != kVariant) return run<kVariant + 1>(job);
    for (std::size_t i = 0; i < job.count; ++i) job.results[i] = ask<kThis>(*job.scene, job.points[i], job.reach);
  }
}

}  // namespace

void HIPRT_BENCH_POINTS(const PointJob& job) { run(job); }

}  // namespace hiprt::bench
