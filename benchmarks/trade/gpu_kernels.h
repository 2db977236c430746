#pragma once
/// The GPU's kernels.

#include "kernels.h"

#include <cstdint>

namespace hiprt::bench {

struct GpuWork {
  Probe probe;
  std::uint64_t first;
  std::uint32_t count;   ///< Rays [first, first + count).
  std::uint32_t* tally;  ///< Of rays skipped, with faults, lost, folded.
};

/// Threads of a block, and for how many blocks of a multiprocessor registers are left (AMD: waves of a SIMD).
inline constexpr unsigned kTraceBlock = 64;
#if defined(__HIP_PLATFORM_AMD__)
inline constexpr unsigned kLeastResident = 4;
#else
inline constexpr unsigned kLeastResident = 14;
#endif

/// Thread i asks ray first + i, or traces it.
using GpuKernel = void (*)(GpuWork);

struct GpuKernels {
  GpuKernel ask, trace;
};

/// @param set in kPolicySets; with Compiler::kFastMath below kFastMathSets.
GpuKernels gpu_kernels(Compiler compiler, std::size_t set);

}  // namespace hiprt::bench
