#pragma once
/// The loop over the rays of a job, for one set of policies.

#include <tools/render/scene/instance_paths.h>
#include <tools/render/tracers/trace_job.h>

#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/primitives/scene_shapes.h>

#include <type_traits>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

template <class Primitives> Primitives make_primitives(const SceneView& scene) {
  if constexpr (std::is_same_v<Primitives, SceneShapes>)
    return SceneShapes(scene);
  else
    return {};
}

/// Stores the hit of ray @p i, and its instance path if the job asks for paths.
template <class P, class AnyHit> void store_hit(const TraceJob& job, std::size_t i, const AnyHit& hit) {
  job.hits[i] = hit;
  if constexpr (P::kLevels != 0)
    if (job.paths != nullptr) store_path(hit, job.paths + i * job.scene->levels, job.scene->levels);
}

/// @param counter receives the work of the query.
template <class Asked, class Primitives, class Stack, class Counter>
auto first_hit(const SceneView& scene, const Ray& ray, Stack& stack, Counter& counter) {
  Asked query(scene, ray, stack, {}, make_primitives<Primitives>(scene), counter);
  const auto hit = query.next_hit();
  counter = query.counter();
  return hit;
}

template <class P, class Primitives = NoPrimitives> void trace_with(const TraceJob& job) {
  using Closest = ClosestHit<P, NoFilter, Primitives>;
  using Any = OneHit<P, NoFilter, Primitives>;
  typename P::Stack::Memory stack;
  for (std::size_t i = 0; i < job.count; ++i) {
    typename P::Counter counter;
    if constexpr (requires { counter.sink; }) counter.sink = job.sink;
    const Ray& ray = job.rays[i];
    const auto hit = job.query == Query::kClosest ? first_hit<Closest, Primitives>(*job.scene, ray, stack, counter)
                                                  : first_hit<Any, Primitives>(*job.scene, ray, stack, counter);
    store_hit<P>(job, i, hit);
    if constexpr (requires { counter.box_tests; })
      if (job.costs != nullptr)
        job.costs[i] = {counter.box_tests, counter.leaf_tests, counter.triangle_tests, counter.instance_tests};
  }
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
