#include <hiprt_build/trace_rays.h>

#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/host_scene.h>

#include <algorithm>
#include <string>

namespace hiprt {
namespace {

/// Rays of one call of a loop's body.
constexpr std::size_t kBlock = 4096;

/// @param many of a HostTracer. @param one traces a ray where there is no HostScene.
build::Result<void> trace_rays(const char* name, const SceneView& scene, std::span<const Ray> rays, std::span<Hit> hits,
                               const ParallelLoop& loop, decltype(HostTracer::closest_hits) HostTracer::*many,
                               Hit (*one)(const SceneView& scene, const Ray& ray)) {
  if (rays.size() > hits.size())
    return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput,
                                       std::string(name) + ": " + std::to_string(rays.size()) + " rays, but room for " +
                                           std::to_string(hits.size()) + " hits"});
  const HostScene* host = current_host_scene(scene);
  const auto trace_block = [&](std::size_t block) {
    const std::size_t first = block * kBlock, count = std::min(kBlock, rays.size() - first);
    if (host != nullptr) return (host->tracer.*many)(scene, rays.data() + first, hits.data() + first, count);
    for (std::size_t i = first; i < first + count; ++i) hits[i] = one(scene, rays[i]);
  };
  const std::size_t blocks = (rays.size() + kBlock - 1) / kBlock;
  if (loop)
    loop(blocks, trace_block);
  else
    for (std::size_t block = 0; block < blocks; ++block) trace_block(block);
  return {};
}

}  // namespace

build::Result<void> closest_hits(const SceneView& scene, std::span<const Ray> rays, std::span<Hit> hits,
                                 const ParallelLoop& loop) {
  return trace_rays("closest_hits", scene, rays, hits, loop, &HostTracer::closest_hits, closest_hit);
}

build::Result<void> any_hits(const SceneView& scene, std::span<const Ray> rays, std::span<Hit> hits,
                             const ParallelLoop& loop) {
  return trace_rays("any_hits", scene, rays, hits, loop, &HostTracer::any_hits, any_hit);
}

}  // namespace hiprt
