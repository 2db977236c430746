#include "kernels.h"

namespace hiprt::bench {

Kernels tradeoff_kernels_usual(std::size_t set);
Kernels tradeoff_kernels_fast_math(std::size_t set);
Kernels tradeoff_kernels_instanced(std::size_t set);

Kernels gpu_kernels(Compiler compiler, std::size_t set, bool instanced) {
  if (instanced) return tradeoff_kernels_instanced(set);
  return compiler == Compiler::kUsual ? tradeoff_kernels_usual(set) : tradeoff_kernels_fast_math(set);
}

}  // namespace hiprt::bench
