#pragma once
/// The traversal in every combination of the policies that a user can choose, for one number of levels: a template that
/// trace_kernels.cpp and others of its name instantiate, once per instruction set.

#include <tools/render/scene/instance_paths.h>
#include <tools/render/scene/trace_limits.h>
#include <tools/render/tracers/trace_job.h>

#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_device/format/layout.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/intersect/exact_triangle_test.h>
#include <hiprt_device/primitives/scene_shapes.h>

#include <type_traits>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

/// Counts, and tells who asks of every step. Of tracers that are not for speed.
struct StepCounter : WorkCounter {
  StepSink sink;

  void on_node(const NodeVisit& visit) const { tell({TraceStep::Kind::kNode, visit, 0, 0}); }
  void on_leaf_at(const std::byte* base, NodeRef leaf) const {
    tell({TraceStep::Kind::kLeaf, {base, leaf, {}, {}}, 0, 0});
  }
  void on_candidate(unsigned slot, float t) const { tell({TraceStep::Kind::kCandidate, {}, slot, t}); }
  void on_enter(std::uint32_t instance) const { tell({TraceStep::Kind::kEnter, {}, instance, 0}); }
  void on_exit() const { tell({TraceStep::Kind::kExit, {}, 0, 0}); }

 private:
  void tell(const TraceStep& step) const {
    if (sink.take != nullptr) sink.take(sink.to, step);
  }
};
static_assert(TraversalObserver<StepCounter>);

template <class Primitives> Primitives make_primitives(const SceneView& scene) {
  if constexpr (std::is_same_v<Primitives, SceneShapes>)
    return SceneShapes(scene);
  else
    return {};
}

/// A query's first answer. @param counter gets its work.
template <class Asked, class Primitives, class Stack, class Counter>
auto first_hit(const SceneView& scene, const Ray& ray, Stack& stack, Counter& counter) {
  Asked query(scene, ray, stack, {}, make_primitives<Primitives>(scene), counter);
  const auto hit = query.next_hit();
  counter = query.counter();
  return hit;
}

template <class P, class Primitives = NoPrimitives> void trace_with(const TraceJob& job) {
  typename P::Stack::Memory stack;
  for (std::size_t i = 0; i < job.count; ++i) {
    typename P::Counter counter;
    if constexpr (requires { counter.sink; }) counter.sink = job.sink;
    using Closest = ClosestHit<P, NoFilter, Primitives>;
    using Any = AnyHit<P, NoFilter, Primitives>;
    const Ray& ray = job.rays[i];
    const auto hit = job.query == Query::kClosest ? first_hit<Closest, Primitives>(*job.scene, ray, stack, counter)
                                                  : first_hit<Any, Primitives>(*job.scene, ray, stack, counter);
    job.hits[i] = hit;
    if constexpr (requires { counter.box_tests; })
      if (job.costs != nullptr)
        job.costs[i] = {counter.box_tests, counter.leaf_tests, counter.triangle_tests, counter.instance_tests};
    if constexpr (P::kLevels != 0)
      if (job.paths != nullptr) store_path(hit, job.paths + i * job.scene->levels, job.scene->levels);
  }
}

template <class LayoutType, class TriangleType = Watertight, class BoxesType = Conservative,
          class CounterType = NoCounter>
struct FlatPolicies : Policies {
  using Layout = LayoutType;
  using Triangle = TriangleType;
  using Boxes = BoxesType;
  using Counter = CounterType;
  using Stack = PrivateStack<kTraceStack + kMostPushed>;
};

template <unsigned kLevels, bool kMoves, class Layout, class Triangle, class Boxes, class Counter>
void trace_counting(const TraceJob& job) {
  using Flat = FlatPolicies<Layout, Triangle, Boxes, Counter>;
  if constexpr (kLevels == 0)
    trace_with<Flat>(job);
  else if constexpr (kMoves)
    trace_with<Moving<Instanced<Flat, kLevels>>>(job);
  else
    trace_with<Instanced<Flat, kLevels>>(job);
}

template <unsigned kLevels, bool kMoves, class Layout, class Triangle, class Boxes>
void choose_counter(const TraceJob& job) {
  // Of the tracers of instances one counts: the largest, which covers all scenes.
  if constexpr (kLevels == 0 || kMoves) {
    using Counting = std::conditional_t<kMoves, StepCounter, WorkCounter>;
    if (job.costs != nullptr) return trace_counting<kLevels, kMoves, Layout, Triangle, Boxes, Counting>(job);
  }
  trace_counting<kLevels, kMoves, Layout, Triangle, Boxes, NoCounter>(job);
}

template <unsigned kLevels, bool kMoves, class Layout, class Triangle> void choose_boxes(const TraceJob& job) {
  job.policies.box_test == BoxTestKind::kConservative
      ? choose_counter<kLevels, kMoves, Layout, Triangle, Conservative>(job)
      : choose_counter<kLevels, kMoves, Layout, Triangle, Plain>(job);
}

template <unsigned kLevels, bool kMoves, class Layout> void choose_triangle(const TraceJob& job) {
  job.policies.triangle_test == TriangleTestKind::kWatertight ? choose_boxes<kLevels, kMoves, Layout, Watertight>(job)
                                                              : choose_boxes<kLevels, kMoves, Layout, Fast>(job);
}

/// @pre the scene has kLevels levels at most, and moves only if kMoves; work is counted only without levels or if
/// kMoves, and steps are told only if kMoves.
template <unsigned kLevels, bool kMoves = false> void trace_levels(const TraceJob& job) {
  dispatch_layout(job.scene->layout, [&](auto layout) { choose_triangle<kLevels, kMoves, decltype(layout)>(job); });
}

/// Rays pass through the holes of materials; with the default policies.
/// @pre as for trace_levels(); the scene has spheres or curves only if kMoves.
template <unsigned kLevels, bool kMoves> void trace_alpha_cutout(const TraceJob& job);

extern template void trace_alpha_cutout<0, false>(const TraceJob& job);
extern template void trace_alpha_cutout<1, false>(const TraceJob& job);
extern template void trace_alpha_cutout<kTraceLevels, true>(const TraceJob& job);
/// With conservative boxes, and no other choice. @pre kLevels and kMoves as for trace_levels(); work is counted and
/// steps are told if kMoves.
template <unsigned kLevels, bool kMoves, class Triangle, class Primitives> void trace_accurate(const TraceJob& job) {
  dispatch_layout(job.scene->layout, [&](auto layout) {
    using Counter = std::conditional_t<kMoves, StepCounter, NoCounter>;
    using Flat = FlatPolicies<decltype(layout), Triangle, Conservative, Counter>;
    if constexpr (kLevels == 0)
      trace_with<Flat, Primitives>(job);
    else
      trace_with<Moving<Instanced<Flat, kLevels>>, Primitives>(job);
  });
}

extern template void trace_accurate<0, false, Watertight, SceneShapes>(const TraceJob& job);
extern template void trace_accurate<kTraceLevels, true, Watertight, SceneShapes>(const TraceJob& job);
extern template void trace_accurate<0, false, Reference, NoPrimitives>(const TraceJob& job);
extern template void trace_accurate<kTraceLevels, true, Reference, SceneShapes>(const TraceJob& job);
extern template void trace_levels<0>(const TraceJob& job);
extern template void trace_levels<1>(const TraceJob& job);
extern template void trace_levels<kTraceLevels>(const TraceJob& job);
extern template void trace_levels<kTraceLevels, true>(const TraceJob& job);

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
