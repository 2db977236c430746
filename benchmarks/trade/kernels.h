#pragma once
/// The traversals that are compared: every policy set, compiled with and without fast-math.

#include "policy_sets.h"

#include <tests/oracle/probe.h>

#include <cstdint>

namespace hiprt::bench {

using oracle::EveryBox, oracle::Probe, oracle::Question, oracle::Tally, oracle::Target;

/// How the kernels are compiled: with the compiler's own settings for floating point, or with -ffast-math
/// (--use_fast_math) and HIPRT_ALLOW_FAST_MATH.
enum class Compiler : unsigned { kUsual, kFastMath };

/// Fast-math is compiled for the first sets only, up to the most accurate one.
inline constexpr std::size_t kFastMathSets = 5;

struct CpuWork {
  std::size_t set;     ///< In kPolicySets.
  const Probe* probe;  ///< Of a scene in the set's layout.
  std::uint64_t begin, end;
  Tally tally;  ///< What was found is added.
};

/// Asks rays [begin, end) on the calling thread.
void ask_on_cpu(Compiler compiler, CpuWork& work);

/// Whether this machine runs the CPU's kernels, which are compiled for AVX2 and FMA where the processor is an x86-64.
bool cpu_can_ask();

}  // namespace hiprt::bench
