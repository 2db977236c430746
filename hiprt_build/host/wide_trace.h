#pragma once
/// The tracers over WideNodes, one per instruction set. Internal.

#include <hiprt_device/host_scene.h>

#include <cstddef>
#include <string_view>

namespace hiprt::format_detail {

/// The functions of a HostScene.
struct WideTracer {
  std::string_view name;  ///< Of the instruction set, as in isa.h.
  decltype(HostScene::closest_hit) closest_hit;
  decltype(HostScene::any_hit) any_hit;
  decltype(HostScene::closest_hits) closest_hits;
  decltype(HostScene::any_hits) any_hits;
};

#ifdef HIPRT_WIDE_ISA_LIST
#define HIPRT_ISA(name)                                                                                 \
  Hit wide_closest_hit_##name(const SceneView& scene, const Ray& ray);                                  \
  Hit wide_any_hit_##name(const SceneView& scene, const Ray& ray);                                      \
  void wide_closest_hits_##name(const SceneView& scene, const Ray* rays, Hit* hits, std::size_t count); \
  void wide_any_hits_##name(const SceneView& scene, const Ray* rays, Hit* hits, std::size_t count);
HIPRT_WIDE_ISA_LIST
#undef HIPRT_ISA
#endif

}  // namespace hiprt::format_detail
