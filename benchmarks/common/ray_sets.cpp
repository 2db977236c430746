#include "ray_sets.h"

#include "sample_blocks.h"
#include "spawned_rays.h"

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <tools/render/tracers/tracer.h>
#include <tools/scene_io/rays_file.h>

#include <cmath>
#include <limits>
#include <utility>

namespace hiprt::bench {
namespace {

constexpr std::uint32_t kWidth = 1920, kHeight = 1080;

std::filesystem::path ray_file(const std::filesystem::path& folder, const std::string& scene, const std::string& kind) {
  return folder / (scene + "." + kind + ".rays");
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
  RaySet ao{"ao", true, cosine_rays(sets[0].rays, hits, 0.1f * diagonal, 1)};
  RaySet diffuse{"diffuse", false, cosine_rays(sets[0].rays, hits, std::numeric_limits<float>::infinity(), 2)};
  sets.push_back(std::move(ao));
  sets.push_back(std::move(diffuse));
  return sets;
}

}  // namespace hiprt::bench
