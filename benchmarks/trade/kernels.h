#pragma once
/// The traversals that are compared: every policy set, compiled with and without fast-math.

#include "policy_sets.h"

#include <tests/oracle/probe.h>

#include <cstdint>

namespace hiprt::bench {

using oracle::Probe, oracle::Question, oracle::Tally, oracle::Target;

/// How the kernels are compiled: with the compiler's own settings for floating point, or with -ffast-math
/// (--use_fast_math) and HIPRT_ALLOW_FAST_MATH.
enum class Compiler : unsigned { kUsual, kFastMath };

struct CpuWork {
  std::size_t set;     ///< In kPolicySets.
  const Probe* probe;  ///< Of a scene in the set's layout.
  bool placed;         ///< The scene is one of instances, which may move: for sets in layout planes.
  std::uint64_t begin, end;
  Tally tally;  ///< What was found is added.
};

}  // namespace hiprt::bench
