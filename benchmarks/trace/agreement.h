#pragma once
/// Do two tracers say the same?

#include <hiprt_device/ray.h>

#include <cstdint>
#include <span>

namespace hiprt::bench {

/// How far two closest hits may be apart: |t1 - t2| <= kRelative * t + kAbsolute * (largest coordinate of the scene).
inline constexpr float kRelativeTolerance = 1e-4f;
inline constexpr float kAbsoluteTolerance = 1e-6f;

/// Rays where one hits and the other misses, or (not any_hit) where the distances are further apart than the
/// tolerance. A ray that a tracer refused counts.
std::uint64_t count_disagreements(std::span<const Hit> hits, std::span<const Hit> reference, bool any_hit, float reach);

/// Rays whose hits are not the same to the last bit (t, u, v, geometry, primitive); any_hit: of which one hits and the
/// other misses.
std::uint64_t count_inexact(std::span<const Hit> hits, std::span<const Hit> reference, bool any_hit);

}  // namespace hiprt::bench
