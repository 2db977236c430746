/// The triangles that touch boxes. Through instances corners are rounded, so decisions are exact only in scenes without
/// them. Compiled once per instruction set (HIPRT_ISA_NAME).

#include <tools/render/tracers/point_policies.h>

#define HIPRT_FIND_OVERLAPS HIPRT_JOIN(find_overlaps_, HIPRT_ISA_NAME)

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {
namespace {

/// @tparam Volume Box or ExactBox.
template <class P, class Volume> bool find_all(const OverlapJob& job) {
  typename P::Stack::Memory memory;
  std::uint32_t path[kTraceLevels];
  bool go_on = true;
  for (std::size_t i = 0; i < job.count && go_on; ++i) {
    const auto take = [&](const BasicOverlap<P::kLevels>& overlap) {
      store_path_of<P>(overlap, path, job.scene->levels);
      return go_on = job.sink.take(job.sink.to, i, {overlap.geometry, overlap.primitive}, path);
    };
    if (overlaps<P>(*job.scene, Volume{job.boxes[i]}, memory, take, {.time = job.time}).failed()) return false;
  }
  return true;
}

}  // namespace
}  // namespace HIPRT_ISA_NAMESPACE

bool HIPRT_FIND_OVERLAPS(const OverlapJob& job);

bool HIPRT_FIND_OVERLAPS(const OverlapJob& job) {
  return dispatch_layout(job.scene->layout, [&](auto layout) {
    using Flat = FlatPolicies<decltype(layout)>;
    if (job.scene->levels == 0) return find_all<Flat, ExactBox>(job);
    return find_all<LevelPolicies<Flat, kTraceLevels, true>, Box>(job);
  });
}

}  // namespace hiprt::tools
