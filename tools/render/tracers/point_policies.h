#pragma once
/// The policies that the queries of points and boxes are compiled for.

#include <tools/render/scene/instance_paths.h>
#include <tools/render/tracers/point_tracer.h>
#include <tools/render/tracers/trace_policies.h>

#include <hiprt_build/format/dispatch_layout.h>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

/// Calls function.template operator()<P>() with the smallest policies that cover a scene.
template <class Function> bool with_point_policies(const SceneView& scene, const Function& function) {
  if (scene.levels == 0 && scene.layout == NodeLayout::kPlanes)
    return function.template operator()<FlatPolicies<PlanesLayout>>();
  return dispatch_layout(scene.layout, [&](auto layout) {
    using Flat = FlatPolicies<decltype(layout)>;
    return function.template operator()<LevelPolicies<Flat, kTraceLevels, true>>();
  });
}

/// @param path kTraceLevels entries that receive the path of a result.
template <class P, class Found>
void store_path_of(const Found& found, [[maybe_unused]] std::uint32_t* path, [[maybe_unused]] std::uint32_t levels) {
  if constexpr (P::kLevels != 0) store_path(found, path, levels);
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools

#define HIPRT_JOIN_EXPANDED(a, b) a##b
#define HIPRT_JOIN(a, b) HIPRT_JOIN_EXPANDED(a, b)
