#include "cpu_kernels.h"

#include <hiprt_build/host/isa.h>

namespace hiprt::bench {

#define HIPRT_ISA(name) void bench_variants_##name(const CpuJob& job);
HIPRT_ISA_LIST
#undef HIPRT_ISA

namespace {

struct Isa {
  const char* name;
  void (*run)(const CpuJob& job);
};

/// Worst first.
constexpr Isa kIsas[] = {
#define HIPRT_ISA(name) {#name, &bench_variants_##name},
    HIPRT_ISA_LIST
#undef HIPRT_ISA
};

const Isa& chosen_isa() {
  static const Isa& chosen = format_detail::best_isa(kIsas);
  return chosen;
}

}  // namespace

void run_on_cpu(const CpuJob& job) { chosen_isa().run(job); }

const char* cpu_isa() { return chosen_isa().name; }

}  // namespace hiprt::bench
