#include "waves.h"

#include "host_trace.h"

#include <benchmarks/common/spawned_rays.h>

#include <tools/render/studio/sampler.h>

#include <limits>
#include <utility>

namespace hiprt::bench {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

std::vector<Ray> camera_rays(const tools::Camera& camera, const Picture& picture) {
  const tools::CameraRays rays(camera, picture.width, picture.height);
  std::vector<Ray> result;
  result.reserve(std::size_t{picture.width} * picture.height);
  for (std::uint32_t y = 0; y < picture.height; ++y)
    for (std::uint32_t x = 0; x < picture.width; ++x) {
      const auto [dx, dy] = tools::PixelSampler(x, y, 0).point(0, tools::SampleUse::kPixel);
      result.push_back(rays.ray(double{1} * x + double{dx}, double{1} * y + double{dy}));
    }
  return result;
}

}  // namespace

std::vector<Wave> make_waves(const SceneView& scene, const SourceScene& source, const Picture& picture,
                             const tools::ThreadLimit& limit) {
  std::vector<Wave> waves;
  const auto add = [&](Wave wave) {
    if (!wave.rays.empty()) waves.push_back(std::move(wave));
  };
  std::vector<Ray> rays = camera_rays(source.camera, picture);
  std::vector<Hit> hits(rays.size());
  for (unsigned bounce = 0; !rays.empty(); ++bounce) {
    const std::string number = std::to_string(bounce);
    hits.resize(rays.size());
    trace_on_host(scene, false, rays, hits, limit);
    // Each wave has its own random numbers.
    Wave shadow{"shadow " + number, "shadow", true,
                source.light ? rays_to(*source.light, rays, hits) : cosine_rays(rays, hits, kFar, 2 * bounce + 1)};
    std::vector<Ray> next;
    if (bounce < picture.bounces) next = cosine_rays(rays, hits, kFar, 2 * bounce + 2);
    add(bounce == 0 ? Wave{"primary", "primary", false, std::move(rays)}
                    : Wave{"bounce " + number, "secondary", false, std::move(rays)});
    add(std::move(shadow));
    rays = std::move(next);
  }
  return waves;
}

}  // namespace hiprt::bench
