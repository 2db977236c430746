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

/// Rays whose hits differ, by kind. Each ray counts once, for the first kind that applies.
struct Disagreements {
  std::uint64_t found = 0;      ///< One tracer hits and the other misses, or it failed.
  std::uint64_t distance = 0;   ///< The distances differ by more than the tolerance.
  std::uint64_t instance = 0;   ///< Same distance, other instance.
  std::uint64_t primitive = 0;  ///< Same distance and instance, other geometry or primitive: an edge's other triangle.

  friend bool operator==(const Disagreements&, const Disagreements&) = default;
};

/// Hits of one tracer.
struct HitList {
  std::span<const Hit> hits;
  /// The id of each hit's outermost instance. Empty: not known, or the scene has no instances.
  std::span<const std::uint32_t> instances;
};

/// Compares ray by ray. Instances are compared if both lists have them. With @p any_hit only `found` is counted.
/// @param reach the scene's largest coordinate.
Disagreements find_disagreements(const HitList& list, const HitList& reference, bool any_hit, float reach);

}  // namespace hiprt::bench
