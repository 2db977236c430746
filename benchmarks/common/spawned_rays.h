#pragma once
/// Secondary rays from the hits of primary rays. The same on every run.

#include <hiprt_device/ray.h>

#include <span>
#include <vector>

namespace hiprt::bench {

/// One ray from each hit, by spawn_origin(), cosine-weighted around the normal on the side that the ray came from.
/// @param rays, hits of the same size. Misses give no ray.
/// @param length of the rays.
/// @param seed other rays for other seeds.
std::vector<Ray> cosine_rays(std::span<const Ray> rays, std::span<const Hit> hits, float length, std::uint32_t seed);

/// One ray from each hit to a point, which is at tmax = 1.
std::vector<Ray> rays_to(const Vec3& point, std::span<const Ray> rays, std::span<const Hit> hits);

}  // namespace hiprt::bench
