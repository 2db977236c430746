#pragma once
/// The kernels of all policy sets and of Embree.

#include "work.h"

#include <benchmarks/engine/kernel.h>

namespace hiprt::bench {

/// Threads per block, and the least number of resident blocks per multiprocessor (AMD: waves per SIMD) for which the
/// compiler limits registers. Traversal through instances needs more registers.
inline constexpr unsigned kTraceBlock = 64;
#if defined(__HIP_PLATFORM_AMD__)
constexpr unsigned least_resident(bool instanced) { return instanced ? 2 : 4; }
#else
constexpr unsigned least_resident(bool instanced) { return instanced ? 8 : 14; }
#endif

/// Item i of a Work is ray first + i.
struct Kernels {
  Kernel check;  ///< Checks the ray and counts faults (oracle::check_ray).
  Kernel trace;  ///< Traces Target::rays[i] into Target::hits[i].
};

/// @param set below kFastMathSets for Compiler::kFastMath.
/// @param instanced only for sets with the layout planes and Compiler::kUsual.
Kernels cpu_kernels(Compiler compiler);
Kernels gpu_kernels(Compiler compiler, std::size_t set, bool instanced);

}  // namespace hiprt::bench
