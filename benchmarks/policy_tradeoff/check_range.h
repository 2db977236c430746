#pragma once
/// The loop of all kernels on CPUs.

#include "work.h"

namespace hiprt::bench {
inline namespace HIPRT_ISA_NAMESPACE {

/// Checks rays [begin, end) of the work one after the other, and adds to its tally.
/// @param tracer has closest(ray) and, for CheckKind::kBoxes, every_box(ray).
template <class Tracer>
void check_range(const Work& work, std::uint64_t begin, std::uint64_t end, const Tracer& tracer) {
  std::uint32_t sums[kTallyWords] = {};
  for (std::uint64_t i = begin; i < end; ++i) {
    const Tally one = oracle::check_ray(work.probe, work.first + i, tracer);
    sums[0] += static_cast<std::uint32_t>(one.skipped);
    sums[1] += static_cast<std::uint32_t>(one.faults);
    sums[2] += static_cast<std::uint32_t>(one.lost);
    sums[3] += static_cast<std::uint32_t>(one.folded);
  }
  // Threads work on ranges of the same job. A builtin: std::atomic_ref's inline functions would be compiled for this
  // file's instruction set, and the linker could keep that copy for the whole program.
  for (std::size_t k = 0; k < kTallyWords; ++k) __atomic_fetch_add(&work.tally[k], sums[k], __ATOMIC_RELAXED);
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::bench
