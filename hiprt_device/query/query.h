#pragma once
/// The two most frequent queries, in one call each. closest_hit.h, any_hit.h and all_hits.h have the others.

#include <hiprt_device/host_scene.h>
#include <hiprt_device/query/all_hits.h>
#include <hiprt_device/query/any_hit.h>
#include <hiprt_device/query/closest_hit.h>
#include <hiprt_device/traverse/hardware_policies.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

// PolicyCheck in a signature makes its messages the first that a compiler prints.

/// The closest hit in [tmin, tmax], or a miss.
/// @param counter its counts are continued: set it to zero to count the work of one ray.
/// @param storage of the traversal's stack; one ray at a time may use it.
template <class P>
HIPRT_HD inline auto closest_hit(const SceneView& scene, const typename PolicyCheck<P>::Ray& ray,
                                 typename P::Counter& counter, const typename PolicyCheck<P>::Storage& storage) {
  ClosestHit<P> query(scene, ray, storage, {}, {}, counter);
  const auto hit = query.next_hit();
  counter = query.counter();
  return hit;
}

/// Any hit in [tmin, tmax], without normal and error, or a miss. Which hit it is depends on the tree.
/// @param counter its counts are continued: set it to zero to count the work of one ray.
/// @param storage of the traversal's stack; one ray at a time may use it.
template <class P>
HIPRT_HD inline auto any_hit(const SceneView& scene, const typename PolicyCheck<P>::Ray& ray,
                             typename P::Counter& counter, const typename PolicyCheck<P>::Storage& storage) {
  OneHit<P> query(scene, ray, storage, {}, {}, counter);
  const auto hit = query.next_hit();
  counter = query.counter();
  return hit;
}

/// The same without the counter.
template <class P>
HIPRT_HD inline auto closest_hit(const SceneView& scene, const typename PolicyCheck<P>::Ray& ray,
                                 const typename PolicyCheck<P>::Storage& storage) {
  return ClosestHit<P>(scene, ray, storage).next_hit();
}

/// The same without the counter.
template <class P>
HIPRT_HD inline auto any_hit(const SceneView& scene, const typename PolicyCheck<P>::Ray& ray,
                             const typename PolicyCheck<P>::Storage& storage) {
  return OneHit<P>(scene, ray, storage).next_hit();
}

/// A stack that needs no storage from the caller: a PrivateStack.
template <class Stack>
concept OwnedStack = std::constructible_from<typename Stack::Storage, typename Stack::Memory&>;

/// The same with a stack of the function's own.
template <class P> HIPRT_HD inline auto closest_hit(const SceneView& scene, const typename PolicyCheck<P>::Ray& ray) {
  static_assert(OwnedStack<typename P::Stack>, "hiprt: this stack needs storage: pass it after the ray");
  typename P::Stack::Memory memory;
  return closest_hit<P>(scene, ray, typename P::Stack::Storage(memory));
}

/// The same with a stack of the function's own.
template <class P> HIPRT_HD inline auto any_hit(const SceneView& scene, const typename PolicyCheck<P>::Ray& ray) {
  static_assert(OwnedStack<typename P::Stack>, "hiprt: this stack needs storage: pass it after the ray");
  typename P::Stack::Memory memory;
  return any_hit<P>(scene, ray, typename P::Stack::Storage(memory));
}

namespace query_detail {

/// Calls call(LayoutType{}) for the scene's layout.
template <class Call> HIPRT_HD HIPRT_FORCE_INLINE auto with_layout(const SceneView& scene, Call&& call) {
  switch (scene.layout) {
    case NodeLayout::kFloat:
      return call(FloatLayout{});
    case NodeLayout::kPlanes:
      return call(PlanesLayout{});
    case NodeLayout::kHalf:
      return call(HalfLayout{});
    case NodeLayout::kQuantized:
      return call(QuantizedLayout{});
  }
  return decltype(call(PlanesLayout{})){};
}

// Functors, because NVRTC treats generic lambdas as host code.

/// Traces with the default policies P of a layout: Trace::run<P>().
template <class Trace> struct InLayout {
  const SceneView& scene;
  const Ray& ray;
  template <class Layout> HIPRT_HD Hit operator()(Layout) const {
    if constexpr (kUsesRayInstruction && RayInstructionLayout<Layout>)
      if (scene.box_margin > 0.0f) return Trace::template run<DefaultHardwarePolicies<Layout>>(scene, ray);
    return Trace::template run<WithLayout<Layout>>(scene, ray);
  }
};
struct TraceClosest {
  template <class P> HIPRT_HD static Hit run(const SceneView& scene, const Ray& ray) {
    return closest_hit<P>(scene, ray);
  }
};
struct TraceAny {
  template <class P> HIPRT_HD static Hit run(const SceneView& scene, const Ray& ray) { return any_hit<P>(scene, ray); }
};

}  // namespace query_detail

/// The closest hit with the default policies, for a scene of any layout. On a host the library's compiled tracer finds
/// it, if open_scene() or Bvh::scene() has made the view.
HIPRT_HD inline Hit closest_hit(const SceneView& scene, const Ray& ray) {
#if !HIPRT_DEVICE_CODE
  if (const HostScene* host = current_host_scene(scene)) return host->tracer.closest_hit(scene, ray);
#endif
  return query_detail::with_layout(scene, query_detail::InLayout<query_detail::TraceClosest>{scene, ray});
}

/// Any hit with the default policies, for a scene of any layout; without normal and error.
HIPRT_HD inline Hit any_hit(const SceneView& scene, const Ray& ray) {
#if !HIPRT_DEVICE_CODE
  if (const HostScene* host = current_host_scene(scene)) return host->tracer.any_hit(scene, ray);
#endif
  return query_detail::with_layout(scene, query_detail::InLayout<query_detail::TraceAny>{scene, ray});
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
