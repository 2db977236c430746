/// The tracers with the default policies. Scenes with one level of still instances have one of their own.

#include <hiprt_build/python/tracers/trace_loop.h>

namespace hiprt::python {
inline namespace HIPRT_ISA_NAMESPACE {

template <class Layout> using WatertightPolicies = FlatPolicies<Layout>;

void trace_watertight(const TraceJob& job) {
  const SceneView& scene = *job.scene;
  const FeatureMask others = feature_bit(Feature::kCustom) | feature_bit(Feature::kMotion);
  if (is_flat(scene)) return trace_with<WatertightPolicies<PlanesLayout>>(job);
  if (scene.levels == 1 && scene.layout == NodeLayout::kPlanes && (scene.features & others) == 0)
    return trace_with<Instanced<WatertightPolicies<PlanesLayout>>>(job);
  trace_general<WatertightPolicies>(job);
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::python
