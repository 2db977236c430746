#include "cpu_kernels.h"

#include <string_view>

namespace hiprt::bench {

#define HIPRT_ISA(name) void bench_variants_##name(const CpuJob& job);
HIPRT_ISA_LIST
#undef HIPRT_ISA

namespace {

struct Isa {
  const char* name;
  void (*run)(const CpuJob& job);
};

constexpr Isa kIsas[] = {
#define HIPRT_ISA(name) {#name, &bench_variants_##name},
    HIPRT_ISA_LIST
#undef HIPRT_ISA
};

/// Whether this machine runs the instruction set: the features that the traversal is compiled to.
bool runs([[maybe_unused]] std::string_view isa) {
#if defined(__x86_64__)
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

/// The list is sorted, worst first.
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

void run_on_cpu(const CpuJob& job) { best_isa().run(job); }

const char* cpu_isa() { return best_isa().name; }

}  // namespace hiprt::bench
