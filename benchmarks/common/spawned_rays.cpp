#include "spawned_rays.h"

#include <hiprt_device/math/vec_functions.h>
#include <hiprt_device/query/spawn.h>
#include <tools/render/studio/sampler.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace hiprt::bench {
namespace {

/// The unit normal on the side that the ray came from.
Vec3 facing_normal(const Ray& ray, const Hit& hit) {
  const Vec3 normal = glm::normalize(hit.normal);
  return glm::dot(normal, ray.direction) > 0.0f ? -normal : normal;
}

/// The sum of the unit normal and a random point of the unit sphere has a cosine-weighted direction.
Vec3 cosine_direction(const Vec3& normal, std::array<float, 2> point) {
  const float z = 1.0f - 2.0f * point[0], radius = std::sqrt(std::max(0.0f, 1.0f - z * z));
  const float angle = 2.0f * std::numbers::pi_v<float> * point[1];
  const Vec3 sum = normal + Vec3(radius * std::cos(angle), radius * std::sin(angle), z);
  const float length = glm::length(sum);
  return length > 1e-6f ? sum / length : normal;
}

}  // namespace

std::vector<Ray> cosine_rays(std::span<const Ray> rays, std::span<const Hit> hits, float length, std::uint32_t seed) {
  std::vector<Ray> result;
  for (std::uint32_t i = 0; i < rays.size(); ++i) {
    if (!hits[i].found()) continue;
    Ray ray;
    const tools::PixelSampler sampler(i, seed, 0);
    ray.direction = cosine_direction(facing_normal(rays[i], hits[i]), sampler.point(0, tools::SampleUse::kDirection));
    ray.origin = spawn_origin(rays[i], hits[i], ray.direction);
    ray.tmax = length;
    result.push_back(ray);
  }
  return result;
}

std::vector<Ray> rays_to(const Vec3& point, std::span<const Ray> rays, std::span<const Hit> hits) {
  std::vector<Ray> result;
  for (std::uint32_t i = 0; i < rays.size(); ++i) {
    if (!hits[i].found()) continue;
    Ray ray;
    const Vec3 at = rays[i].origin + hits[i].t * rays[i].direction;
    ray.origin = spawn_origin(rays[i], hits[i], point - at);
    ray.direction = point - ray.origin;
    ray.tmax = 1.0f;
    result.push_back(ray);
  }
  return result;
}

}  // namespace hiprt::bench
