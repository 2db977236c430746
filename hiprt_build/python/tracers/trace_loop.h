#pragma once
/// The loop over the rays of a job, for one set of policies.

#include <hiprt_build/python/gpu/device/tracer.h>
#include <hiprt_build/python/tracers/kernels.h>

#include <hiprt_build/format/dispatch_layout.h>

namespace hiprt::python {
inline namespace HIPRT_ISA_NAMESPACE {

template <class Layout, class Triangle = Watertight, class Boxes = Conservative>
using FlatPolicies = TracerPolicies<Layout, kMostEntries + kMostPushed, Triangle, Boxes>;

/// @tparam Asked ClosestHit or OneHit.
template <class P, class Asked, class Primitives> void first_hits(const TraceJob& job) {
  const SceneView& scene = *job.scene;
  typename P::Stack::Memory stack;
  for (std::size_t i = 0; i < job.count; ++i) {
    const auto& ray = static_cast<const BasicRay<typename P::Real>*>(job.rays)[i];
    const auto hit = Asked(scene, ray, stack, {}, make_primitives<Primitives>(scene)).next_hit();
    static_cast<BasicHit<typename P::Real>*>(job.hits)[i] = hit;
    if (job.paths != nullptr) store_path<P>(hit, job.paths + i * scene.levels, scene.levels);
  }
}

template <class P, class Primitives> void all_hits(const TraceJob& job) {
  const SceneView& scene = *job.scene;
  typename P::Stack::Memory stack;
  std::uint32_t path[kMostLevels];
  for (std::size_t i = 0; i < job.count; ++i) {
    const auto& ray = static_cast<const BasicRay<typename P::Real>*>(job.rays)[i];
    AnyHit<P, NoFilter, Primitives> query(scene, ray, stack, {}, make_primitives<Primitives>(scene));
    for (auto hit = query.next_hit(); hit.found(); hit = query.next_hit()) {
      store_path<P>(hit, path, scene.levels);
      if (!job.sink.take(job.sink.to, i, {hit.t, hit.u, hit.v, hit.geometry, hit.primitive}, path)) return;
    }
  }
}

template <class P, class Primitives = NoPrimitives> void trace_with(const TraceJob& job) {
  switch (job.query) {
    case Query::kClosest:
      return first_hits<P, ClosestHit<P, NoFilter, Primitives>, Primitives>(job);
    case Query::kAny:
      return first_hits<P, OneHit<P, NoFilter, Primitives>, Primitives>(job);
    case Query::kAll:
      return all_hits<WithoutSurface<P>, Primitives>(job);
  }
}

/// Scenes of every kind.
/// @tparam Flat policies of a layout.
template <template <class Layout> class Flat> void trace_general(const TraceJob& job) {
  dispatch_layout(job.scene->layout, [&](auto layout) {
    trace_with<Moving<Instanced<Flat<decltype(layout)>, kMostLevels>>, SceneShapes>(job);
  });
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::python
