#pragma once
/// The tracers over WideNodes, one per instruction set. Internal.

#include <hiprt_device/ray.h>
#include <hiprt_device/scene_view.h>

#include <string_view>

namespace hiprt::format_detail {

struct WideTracer {
  std::string_view name;  ///< Of the instruction set, as in isa.h.
  Hit (*closest_hit)(const SceneView& scene, const Ray& ray);
  Hit (*any_hit)(const SceneView& scene, const Ray& ray);
};

#ifdef HIPRT_WIDE_ISA_LIST
#define HIPRT_ISA(name)                                                \
  Hit wide_closest_hit_##name(const SceneView& scene, const Ray& ray); \
  Hit wide_any_hit_##name(const SceneView& scene, const Ray& ray);
HIPRT_WIDE_ISA_LIST
#undef HIPRT_ISA
#endif

}  // namespace hiprt::format_detail
