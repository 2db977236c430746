#include "kernels.h"

namespace hiprt::bench {

void tradeoff_run_usual(const Work& work, std::uint64_t begin, std::uint64_t end);
void tradeoff_run_fast_math(const Work& work, std::uint64_t begin, std::uint64_t end);

namespace {

template <auto kRun> void run(const void* job, std::uint64_t begin, std::uint64_t end) {
  kRun(*static_cast<const Work*>(job), begin, end);
}

}  // namespace

Kernels cpu_kernels(Compiler compiler) {
  const CpuFunction function = compiler == Compiler::kUsual ? run<tradeoff_run_usual> : run<tradeoff_run_fast_math>;
  // The kind in Work::probe tells checks from traces.
  return {{.cpu = function}, {.cpu = function}};
}

}  // namespace hiprt::bench
