#pragma once
/// Which of the instruction sets that something was compiled for this machine runs best. For sources that are compiled
/// for the lowest of them.

#include <cstddef>
#include <string_view>

namespace hiprt::tools {

/// Whether this machine runs code for the instruction set, named as in HIPRT_ISA_LIST: the features that the traversal
/// is compiled to, and every processor with them has the rest of the level.
inline bool runs_isa([[maybe_unused]] std::string_view isa) {
#if defined(__x86_64__)
  if (isa == "x86_64_v2") return __builtin_cpu_supports("sse4.2") != 0 && __builtin_cpu_supports("popcnt") != 0;
  if (isa == "x86_64_v3")
    return __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0 &&
           __builtin_cpu_supports("bmi") != 0 && __builtin_cpu_supports("bmi2") != 0;
  if (isa == "x86_64_v4")
    return runs_isa("x86_64_v3") && __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512bw") != 0 &&
           __builtin_cpu_supports("avx512cd") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
           __builtin_cpu_supports("avx512vl") != 0;
#endif
  return true;
}

/// @param variants with a `name` each, worst first; the first runs everywhere.
template <class Variant, std::size_t N> const Variant& best_isa(const Variant (&variants)[N]) {
  const Variant* best = &variants[0];
  for (const Variant& variant : variants)
    if (runs_isa(variant.name)) best = &variant;
  return *best;
}

}  // namespace hiprt::tools
