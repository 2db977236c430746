#pragma once
/// The job of every kernel, on CPUs and GPUs: a range of rays and how they are checked.

#include "policy_sets.h"

#include <tests/oracle/probe.h>

#include <cstdint>

struct RTCSceneTy;

namespace hiprt::bench {

using oracle::Probe, oracle::CheckKind, oracle::Tally, oracle::Target;

/// Floating-point settings of the compiler: its defaults, or -ffast-math (--use_fast_math) with
/// HIPRT_ALLOW_FAST_MATH.
enum class Compiler : unsigned { kUsual, kFastMath };

/// Numbers in Work::tally: rays skipped, with faults, lost, folded (oracle::Tally).
inline constexpr std::size_t kTallyWords = 4;

struct Work {
  Probe probe;                     ///< With a scene in the set's layout.
  std::uint64_t first = 0;         ///< Number of the first ray.
  std::uint32_t count = 0;         ///< Rays.
  std::uint32_t set = 0;           ///< Index into kPolicySets. Kernels of GPUs are compiled for one set.
  bool instanced = false;          ///< The scene has instances, which may move. For sets with the layout planes.
  RTCSceneTy* embree = nullptr;    ///< An RTCScene, for the kernels of Embree.
  std::uint32_t* tally = nullptr;  ///< kTallyWords counters to which kernels add.
};

}  // namespace hiprt::bench
