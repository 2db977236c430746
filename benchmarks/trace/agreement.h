#pragma once
/// Compares the hits of two tracers.

#include <hiprt_device/ray.h>

#include <cstdint>
#include <span>

namespace hiprt::bench {

/// Largest difference of two closest hits that agree: |t1 - t2| <= kRelative * t + kAbsolute * (largest coordinate of
/// the scene).
inline constexpr float kRelativeTolerance = 1e-4f;
inline constexpr float kAbsoluteTolerance = 1e-6f;

/// Number of rays that one tracer hits and the other misses, or (without any_hit) whose distances differ by more than
/// the tolerance. Failed rays count.
std::uint64_t count_disagreements(std::span<const Hit> hits, std::span<const Hit> reference, bool any_hit, float reach);

/// Number of rays whose hits differ in any bit (t, u, v, geometry, primitive); with any_hit: that one tracer hits and
/// the other misses.
std::uint64_t count_inexact(std::span<const Hit> hits, std::span<const Hit> reference, bool any_hit);

/// Number of rays that both tracers hit, but in different triangles.
std::uint64_t count_other_primitives(std::span<const Hit> hits, std::span<const Hit> reference);

}  // namespace hiprt::bench
