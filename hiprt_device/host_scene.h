#pragma once
/// What a host has prepared to trace a scene fast: eight-wide nodes, and tracers compiled for its processor.

#include <hiprt_device/format/buffer.h>
#include <hiprt_device/ray.h>
#include <hiprt_device/scene_view.h>

namespace hiprt {

struct HostNode;

/// Functions that the library has compiled for one instruction set.
/// @pre of all: current_host_scene(scene) is the HostScene that has them
struct HostTracer {
  Hit (*closest_hit)(const SceneView& scene, const Ray& ray);
  Hit (*any_hit)(const SceneView& scene, const Ray& ray);
  void (*closest_hits)(const SceneView& scene, const Ray* rays, Hit* hits, std::size_t count);
  void (*any_hits)(const SceneView& scene, const Ray* rays, Hit* hits, std::size_t count);
};

/// open_scene() and Bvh::scene() make it for flat scenes of triangles in layout planes. The hits are those of the
/// scene's own nodes, bit for bit.
struct HostScene {
  const HostNode* nodes = nullptr;  ///< The first is the root. nullptr: there are none.
  std::uint64_t checksum = 0;       ///< FileHeader::checksum of the file when the nodes were made.
  HostTracer tracer{};
  std::uint64_t bytes = 0;                ///< Of the nodes and of the leaves below them.
  alignas(16) float low[4]{}, high[4]{};  ///< The scene's bounds; the fourth number is 0.
  float magnitude = 0.0f;                 ///< The largest coordinate of the bounds, without its sign.
  float extent = 0.0f;                    ///< The bounds' longest side.
};

inline namespace HIPRT_ISA_NAMESPACE {

/// What the host has prepared, unless the file has been refitted since. nullptr: nothing.
/// @pre the scene lies in the host's memory.
HIPRT_HD inline const HostScene* current_host_scene(const SceneView& scene) {
  const HostScene* host = scene.host;
  if (host == nullptr || host->nodes == nullptr) return nullptr;
  return reinterpret_cast<const FileHeader*>(scene.base)->checksum == host->checksum ? host : nullptr;
}

}  // namespace HIPRT_ISA_NAMESPACE

}  // namespace hiprt
