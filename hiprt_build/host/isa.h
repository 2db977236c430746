#pragma once
/// Chooses the best of several variants that are compiled for different instruction sets. For sources that are compiled
/// for the lowest of these sets.

#include <cstddef>
#include <string_view>

namespace hiprt::format_detail {

/// @return whether this machine runs code for the instruction set, named as in HIPRT_ISA_LIST. Only the features that
/// the compiled traversal uses are checked: every processor with them has the rest of the level.
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

/// @param variants each has a `name`. The worst is first; it runs everywhere. @return the best variant for this
/// machine.
template <class Variant, std::size_t N> const Variant& best_isa(const Variant (&variants)[N]) {
  const Variant* best = &variants[0];
  for (const Variant& variant : variants)
    if (runs_isa(variant.name)) best = &variant;
  return *best;
}

}  // namespace hiprt::format_detail
