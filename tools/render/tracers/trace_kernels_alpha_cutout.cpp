/// The traversal of scenes whose materials have holes.

#include <tools/render/scene/path_surface.h>
#include <tools/render/tracers/trace_kernels.h>

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
                         : AnyHit<P, AlphaCutout, Primitives>(*job.scene, ray, stack, filter, primitives).next_hit();
    job.hits[i] = hit;
    if constexpr (P::kLevels != 0)
      if (job.paths != nullptr) store_path(hit, job.paths + i * job.scene->levels, job.scene->levels);
  }
}

}  // namespace

template <unsigned kLevels, bool kMoves> void trace_alpha_cutout(const TraceJob& job) {
  dispatch_layout(job.scene->layout, [&](auto layout) {
    using Flat = FlatPolicies<decltype(layout)>;
    if constexpr (kMoves)
      trace_filtered<Moving<Instanced<Flat, kLevels>>, SceneShapes>(job);
    else if constexpr (kLevels != 0)
      trace_filtered<Instanced<Flat, kLevels>, NoPrimitives>(job);
    else
      trace_filtered<Flat, NoPrimitives>(job);
  });
}

template void trace_alpha_cutout<0, false>(const TraceJob& job);
template void trace_alpha_cutout<1, false>(const TraceJob& job);
template void trace_alpha_cutout<kTraceLevels, true>(const TraceJob& job);

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
