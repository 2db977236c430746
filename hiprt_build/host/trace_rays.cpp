#include <hiprt_build/trace_rays.h>

#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/host_scene.h>

#include <algorithm>
#include <string>

namespace hiprt {
namespace {

/// Rays of one call of a loop's body.
constexpr std::size_t kBlock = 4096;

/// @param trace traces some of the rays: (first ray, first hit, count).
template <class Trace>
build::Result<void> trace_blocks(const char* name, std::span<const Ray> rays, std::span<Hit> hits,
                                 const ParallelLoop& loop, const Trace& trace) {
  if (rays.size() > hits.size())
    return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput,
                                       std::string(name) + ": " + std::to_string(rays.size()) + " rays, but room for " +
                                           std::to_string(hits.size()) + " hits"});
  const auto trace_block = [&](std::size_t block) {
    const std::size_t first = block * kBlock;
    trace(rays.data() + first, hits.data() + first, std::min(kBlock, rays.size() - first));
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
  const HostScene* host = current_host_scene(scene);
  return trace_blocks("closest_hits", rays, hits, loop, [&](const Ray* ray, Hit* hit, std::size_t count) {
    if (host != nullptr) return host->closest_hits(scene, ray, hit, count);
    for (std::size_t i = 0; i < count; ++i) hit[i] = closest_hit(scene, ray[i]);
  });
}

build::Result<void> any_hits(const SceneView& scene, std::span<const Ray> rays, std::span<Hit> hits,
                             const ParallelLoop& loop) {
  const HostScene* host = current_host_scene(scene);
  return trace_blocks("any_hits", rays, hits, loop, [&](const Ray* ray, Hit* hit, std::size_t count) {
    if (host != nullptr) return host->any_hits(scene, ray, hit, count);
    for (std::size_t i = 0; i < count; ++i) hit[i] = any_hit(scene, ray[i]);
  });
}

}  // namespace hiprt
