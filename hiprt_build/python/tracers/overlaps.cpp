/// The triangles that touch boxes. Through instances the corners of triangles are rounded, so decisions are exact only
/// in scenes without them.

#include <hiprt_build/python/tracers/trace_loop.h>

namespace hiprt::python {
inline namespace HIPRT_ISA_NAMESPACE {
namespace {

/// @tparam Volume Box or ExactBox.
template <class P, class Volume> bool find_all(const OverlapJob& job) {
  const SceneView& scene = *job.scene;
  typename P::Stack::Memory memory;
  std::uint32_t path[kMostLevels];
  bool go_on = true;
  for (std::size_t i = 0; i < job.count && go_on; ++i) {
    const auto take = [&](const BasicOverlap<P::kLevels>& overlap) {
      store_path<P>(overlap, path, scene.levels);
      return go_on = job.sink.take(job.sink.to, i, {overlap.geometry, overlap.primitive}, path);
    };
    if (overlaps<P>(scene, Volume{job.boxes[i]}, memory, take, job.visible[i]).failed()) return false;
  }
  return true;
}

}  // namespace

bool find_overlaps(const OverlapJob& job) {
  return dispatch_layout(job.scene->layout, [&](auto layout) {
    using Flat = FlatPolicies<decltype(layout)>;
    if (job.scene->levels == 0) return find_all<Flat, ExactBox>(job);
    return find_all<Moving<Instanced<Flat, kMostLevels>>, Box>(job);
  });
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::python
