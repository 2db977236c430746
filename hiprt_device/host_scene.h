#pragma once
/// What a host has prepared to trace a scene fast: eight-wide nodes, and tracers compiled for its processor.

#include <hiprt_device/format/wide_node.h>
#include <hiprt_device/ray.h>
#include <hiprt_device/scene_view.h>

namespace hiprt {

/// open_scene() and Bvh::scene() make it for flat scenes of triangles in layout planes. The hits are those of the
/// scene's own nodes, bit for bit.
struct HostScene {
  const WideNode* nodes = nullptr;  ///< The first is the root.
  std::uint64_t checksum = 0;       ///< FileHeader::checksum of the file when the nodes were made.
  Hit (*closest_hit)(const SceneView& scene, const Ray& ray) = nullptr;
  Hit (*any_hit)(const SceneView& scene, const Ray& ray) = nullptr;
  void (*closest_hits)(const SceneView& scene, const Ray* rays, Hit* hits, std::size_t count) = nullptr;
  void (*any_hits)(const SceneView& scene, const Ray* rays, Hit* hits, std::size_t count) = nullptr;
};

inline namespace HIPRT_ISA_NAMESPACE {

/// What the host has prepared, unless the file has been refitted since. nullptr: nothing.
/// @pre the scene lies in the host's memory.
HIPRT_HD inline const HostScene* current_host_scene(const SceneView& scene) {
  const HostScene* host = scene.host;
  if (host == nullptr || reinterpret_cast<const FileHeader*>(scene.base)->checksum != host->checksum) return nullptr;
  return host;
}

}  // namespace HIPRT_ISA_NAMESPACE

}  // namespace hiprt
