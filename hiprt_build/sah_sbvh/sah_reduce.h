#pragma once
/// Bounds and bins of a range of references, computed by several threads if the range is large. Internal.

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/sah_sbvh/sah_bins.h>

namespace hiprt::build {

/// Ranges above this are worth more than one thread.
inline constexpr std::size_t kParallelSize = 65536;

/// sum(references, so far) over the parts of a range, combined by combine(a, b). The result must not depend on how it
/// is parted.
template <class T, class Sum, class Combine>
T reduce_references(CpuEngine& engine, std::span<const Reference> references, const T& none, const Sum& sum,
                    const Combine& combine) {
  if (references.size() < kParallelSize) return sum(references, none);
  return Threads::reduce(
      references.size(), CpuEngine::kChunk, none,
      [&](std::size_t begin, std::size_t end, const T& so_far) {
        engine.monitor().check();
        return sum(references.subspan(begin, end - begin), so_far);
      },
      combine);
}

inline RangeBounds bound_references(CpuEngine& engine, std::span<const Reference> references) {
  return reduce_references(
      engine, references, RangeBounds{},
      [](std::span<const Reference> part, RangeBounds bounds) {
        for (const Reference& reference : part) bounds.add(simd_box(reference));
        return bounds;
      },
      [](RangeBounds a, const RangeBounds& b) {
        a.add(b);
        return a;
      });
}

inline Bins bin_references(CpuEngine& engine, std::span<const Reference> references, const BinMapping& mapping) {
  return reduce_references(
      engine, references, Bins{},
      [&](std::span<const Reference> part, Bins bins) {
        bins.add(part, mapping);
        return bins;
      },
      [&](Bins a, const Bins& b) {
        a.add(b, mapping.bins);
        return a;
      });
}

}  // namespace hiprt::build
