/// The tracers for scenes whose materials cut out parts of triangles.

#include <tools/render/scene/path_surface.h>
#include <tools/render/tracers/trace_kernels.h>
#include <tools/render/tracers/trace_loop.h>
#include <tools/render/tracers/trace_policies.h>

#include <hiprt_build/format/dispatch_layout.h>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {
namespace {

template <class P, class Primitives> void trace_filtered(const TraceJob& job) {
  typename P::Stack::Memory memory;
  const typename P::Stack::Storage stack(memory);
  const AlphaCutout filter{job.cutout_scene};
  const auto primitives = make_primitives<Primitives>(*job.scene);
  for (std::size_t i = 0; i < job.count; ++i) {
    const Ray& ray = job.rays[i];
    const auto hit = job.query == Query::kClosest
                         ? ClosestHit<P, AlphaCutout, Primitives>(*job.scene, ray, stack, filter, primitives).next_hit()
                         : OneHit<P, AlphaCutout, Primitives>(*job.scene, ray, stack, filter, primitives).next_hit();
    store_hit<P>(job, i, hit);
  }
}

}  // namespace

template <unsigned kLevels, bool kMoves> void trace_alpha_cutout(const TraceJob& job) {
  dispatch_layout(job.scene->layout, [&](auto layout) {
    using Flat = FlatPolicies<decltype(layout)>;
    using Primitives = std::conditional_t<kMoves, SceneShapes, NoPrimitives>;
    trace_filtered<LevelPolicies<Flat, kLevels, kMoves>, Primitives>(job);
  });
}

template void trace_alpha_cutout<0, false>(const TraceJob& job);
template void trace_alpha_cutout<1, false>(const TraceJob& job);
template void trace_alpha_cutout<kTraceLevels, true>(const TraceJob& job);

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
