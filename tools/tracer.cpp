#include "tracer.h"

#include "trace_job.h"

#include <string_view>

namespace hiprt::tools {

#define HIPRT_ISA(name) void trace_##name(const TraceJob& job);
HIPRT_ISA_LIST
#undef HIPRT_ISA

namespace {

struct Isa {
  std::string_view name;
  void (*trace)(const TraceJob& job);
};

/// Worst first.
constexpr Isa kIsas[] = {
#define HIPRT_ISA(name) {#name, &trace_##name},
    HIPRT_ISA_LIST
#undef HIPRT_ISA
};

/// Can this machine run code for the instruction set?
bool runs([[maybe_unused]] std::string_view isa) {
#if defined(__x86_64__)
  // The features that the traversal is compiled to; every processor with them has the rest of the level.
  if (isa == "x86_64_v2") return __builtin_cpu_supports("sse4.2") != 0 && __builtin_cpu_supports("popcnt") != 0;
  if (isa == "x86_64_v3")
    return __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0 &&
           __builtin_cpu_supports("bmi") != 0 && __builtin_cpu_supports("bmi2") != 0;
  if (isa == "x86_64_v4")
    return runs("x86_64_v3") && __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512bw") != 0 &&
           __builtin_cpu_supports("avx512cd") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
           __builtin_cpu_supports("avx512vl") != 0;
#endif
  return true;
}

const Isa& best_isa() {
  static const Isa& best = []() -> const Isa& {
    const Isa* chosen = &kIsas[0];
    for (const Isa& isa : kIsas)
      if (runs(isa.name)) chosen = &isa;
    return *chosen;
  }();
  return best;
}

}  // namespace

void trace(const SceneView& scene, Query query, const TracePolicies& policies, std::span<const Ray> rays,
           std::span<Hit> hits, std::span<RayCost> costs) {
  best_isa().trace(
      {&scene, query, policies, rays.data(), hits.data(), costs.empty() ? nullptr : costs.data(), rays.size()});
}

const char* trace_isa() { return best_isa().name.data(); }

}  // namespace hiprt::tools
