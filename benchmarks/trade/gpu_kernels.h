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

/// Threads of a block, and for how many blocks of a multiprocessor registers are left (AMD: waves of a SIMD): more are
/// needed on the way through instances.
inline constexpr unsigned kTraceBlock = 64;
#if defined(__HIP_PLATFORM_AMD__)
constexpr unsigned least_resident(bool placed) { return placed ? 2 : 4; }
#else
constexpr unsigned least_resident(bool placed) { return placed ? 8 : 14; }
#endif

/// Thread i asks ray first + i, or traces it.
using GpuKernel = void (*)(GpuWork);

struct GpuKernels {
  GpuKernel ask, trace;
};

/// @param set in kPolicySets; with Compiler::kFastMath below kFastMathSets. @param placed the scene is one of
/// instances, which may move: for sets in layout planes, by the usual compiler.
GpuKernels gpu_kernels(Compiler compiler, std::size_t set, bool placed);

}  // namespace hiprt::bench
