#include "kernel.h"

#include <hiprt_build/trace_rays.h>
#include <hiprt_device/hiprt_device.h>
#include <tools/render/tracers/tracer.h>

#include <span>
#include <string_view>
#include <tuple>

namespace hiprt::bench {

#define HIPRT_ISA(name) void bench_trace_##name(const KernelJob& job);
HIPRT_ISA_LIST
#undef HIPRT_ISA

namespace {

struct Isa {
  std::string_view name;
  void (*run)(const KernelJob& job);
};

constexpr Isa kIsas[] = {
#define HIPRT_ISA(name) {#name, &bench_trace_##name},
    HIPRT_ISA_LIST
#undef HIPRT_ISA
};

void run_many(const KernelJob& job) {
  const std::span rays(job.rays, job.count);
  const std::span hits(job.hits, job.count);
  // There is a hit per ray, so neither fails.
  if (job.any_hit)
    std::ignore = any_hits(*job.scene, rays, hits);
  else
    std::ignore = closest_hits(*job.scene, rays, hits);
}

void run_on_host(const KernelJob& job) {
  for (std::size_t i = 0; i < job.count; ++i)
    job.hits[i] = job.any_hit ? any_hit(*job.scene, job.rays[i]) : closest_hit(*job.scene, job.rays[i]);
}

}  // namespace

void run_kernel(const KernelJob& job) {
  if (job.lanes == Lanes::kHost) return run_on_host(job);
  if (job.lanes == Lanes::kMany) return run_many(job);
  static const Isa& best = []() -> const Isa& {
    const Isa* chosen = &kIsas[0];
    for (const Isa& isa : kIsas)
      if (isa.name == tools::trace_isa()) chosen = &isa;
    return *chosen;
  }();
  best.run(job);
}

}  // namespace hiprt::bench
