#include "ray_sets.h"

#include <hiprt_build/build.h>
#include <hiprt_device/format/view.h>
#include <hiprt_device/spawn.h>
#include <tools/rays_file.h>
#include <tools/sampler.h>
#include <tools/tracer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <utility>

namespace hiprt::bench {
namespace {

constexpr std::uint32_t kBlock = 64;
constexpr std::uint32_t kWidth = 1920, kHeight = 1080;

std::filesystem::path ray_file(const std::filesystem::path& folder, const std::string& scene, const std::string& kind) {
  return folder / (scene + "." + kind + ".rays");
}

/// The unit normal on the side that the ray came from.
Vec3 facing_normal(const Ray& ray, const Hit& hit) {
  const Vec3 normal = glm::normalize(hit.normal);
  return glm::dot(normal, ray.direction) > 0.0f ? -normal : normal;
}

/// The sum of a unit vector and a point of the unit sphere has a direction of cosine-weighted density.
Vec3 cosine_direction(const Vec3& normal, std::array<float, 2> point) {
  const float z = 1.0f - 2.0f * point[0], radius = std::sqrt(std::max(0.0f, 1.0f - z * z));
  const float angle = 2.0f * std::numbers::pi_v<float> * point[1];
  const Vec3 sum = normal + Vec3(radius * std::cos(angle), radius * std::sin(angle), z);
  const float length = glm::length(sum);
  return length > 1e-6f ? sum / length : normal;
}

/// One ray from each hit.
RaySet secondary_rays(const RaySet& primary, const std::vector<Hit>& hits, std::string kind, bool any_hit,
                      float length) {
  RaySet set{std::move(kind), any_hit, {}};
  for (std::uint32_t i = 0; i < primary.rays.size(); ++i) {
    if (!hits[i].found()) continue;
    Ray ray;
    const tools::PixelSampler sampler(i, any_hit ? 1 : 2, 0);
    const Vec3 normal = facing_normal(primary.rays[i], hits[i]);
    ray.direction = cosine_direction(normal, sampler.point(0, tools::SampleUse::kDirection));
    ray.origin = spawn_origin(primary.rays[i], hits[i], ray.direction);
    ray.tmax = length;
    set.rays.push_back(ray);
  }
  return set;
}

RaySet camera_rays(const tools::Camera& camera, std::uint32_t wanted) {
  RaySet set{"primary", false, {}};
  const tools::CameraRays rays(camera, kWidth, kHeight);
  for (const std::uint32_t i : sample_blocks(kWidth * kHeight, wanted)) {
    const std::uint32_t column = i % kWidth, row = i / kWidth;
    set.rays.push_back(rays.ray(column + 0.5, row + 0.5));
  }
  return set;
}

}  // namespace

std::vector<std::string> stored_kinds(const std::filesystem::path& folder, const std::string& scene) {
  std::vector<std::string> kinds;
  for (const char* kind : {"primary", "ao", "shadow", "diffuse", "diffuse2"})
    if (std::filesystem::exists(ray_file(folder, scene, kind))) kinds.emplace_back(kind);
  return kinds;
}

build::Result<RaySet> read_ray_set(const std::filesystem::path& folder, const std::string& scene,
                                   const std::string& kind, std::uint32_t wanted) {
  const auto batch = tools::read_rays(ray_file(folder, scene, kind));
  if (!batch) return tl::unexpected(batch.error());
  RaySet set{kind, batch->any_hit, {}};
  for (const std::uint32_t i : sample_blocks(static_cast<std::uint32_t>(batch->rays.size()), wanted))
    set.rays.push_back(batch->rays[i]);
  return set;
}

std::vector<std::string> generated_kinds() { return {"primary", "ao", "diffuse"}; }

build::Result<std::vector<RaySet>> generate_ray_sets(const tools::Mesh& mesh, const tools::Camera& camera,
                                                     std::uint32_t wanted) {
  const build::TriangleMesh input{.positions = mesh.positions, .triangles = mesh.triangles};
  const auto bvh = build::build({&input, 1});
  if (!bvh) return tl::unexpected(bvh.error());
  const auto view = open_buffer(bvh->buffer.bytes());
  const SceneView scene = make_scene_view(*view);
  std::vector<RaySet> sets{camera_rays(camera, wanted)};
  std::vector<Hit> hits(sets[0].rays.size());
  tools::trace(scene, tools::Query::kClosest, {}, sets[0].rays, hits);
  const auto size = [&](int axis) { return scene.bounds.max[axis] - scene.bounds.min[axis]; };
  const float diagonal = std::hypot(size(0), size(1), size(2));
  RaySet ao = secondary_rays(sets[0], hits, "ao", true, 0.1f * diagonal);
  RaySet diffuse = secondary_rays(sets[0], hits, "diffuse", false, std::numeric_limits<float>::infinity());
  sets.push_back(std::move(ao));
  sets.push_back(std::move(diffuse));
  return sets;
}

std::vector<std::uint32_t> sample_blocks(std::uint32_t count, std::uint32_t wanted) {
  const std::uint32_t blocks = (count + kBlock - 1) / kBlock;
  const std::uint32_t step = wanted >= count ? 1 : std::max(1u, (count + wanted / 2) / std::max(1u, wanted));
  std::vector<std::uint32_t> chosen;
  std::mt19937 random;
  for (std::uint32_t group = 0; group < blocks; group += step) {
    const std::uint32_t block = group + static_cast<std::uint32_t>(random()) % std::min(step, blocks - group);
    for (std::uint32_t i = block * kBlock; i < std::min(count, (block + 1) * kBlock); ++i) chosen.push_back(i);
  }
  return chosen;
}

}  // namespace hiprt::bench
