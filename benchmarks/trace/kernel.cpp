#include "kernel.h"

#include <tools/render/tracers/tracer.h>

#include <string_view>

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

}  // namespace

void run_kernel(const KernelJob& job) {
  static const Isa& best = []() -> const Isa& {
    const Isa* chosen = &kIsas[0];
    for (const Isa& isa : kIsas)
      if (isa.name == tools::trace_isa()) chosen = &isa;
    return *chosen;
  }();
  best.run(job);
}

}  // namespace hiprt::bench
