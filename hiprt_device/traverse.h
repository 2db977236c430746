#pragma once
/// THE traversal loop: stack-based, one text for every query, layout, test and machine.

#include <hiprt_device/order.h>
#include <hiprt_device/policies.h>

#include <cmath>
#include <limits>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Whether the ray can hit anything at all; false for NaN and infinite components.
HIPRT_HD HIPRT_INLINE bool is_traceable(const Ray& ray) {
  constexpr float kMax = std::numeric_limits<float>::max();
  const float length = max_component(ray.direction);
  const float sum = absolute(ray.direction.x) * 0.0f + absolute(ray.direction.y) * 0.0f +
                    absolute(ray.direction.z) * 0.0f + ray.origin.x * 0.0f + ray.origin.y * 0.0f + ray.origin.z * 0.0f +
                    ray.tmin * 0.0f;
  return sum == 0.0f && length > 0.0f && length <= kMax && ray.tmin <= ray.tmax && ray.tmax >= 0.0f && ray.mask != 0;
}

/// Visits the leaves whose boxes the ray meets in [tmin, limit], in the order of Order.
/// @param limit read before every box test: the visitor may lower it.
/// @param visit bool(const Leaf&, prepared ray): false stops.
/// @param storage where the stack keeps its entries.
/// @pre covers<P>(scene), is_traceable(ray)
template <class P, class Order, class Visit>
HIPRT_HD HIPRT_INLINE void traverse(const SceneView& scene, const Ray& ray, const float& limit,
                                    const typename P::Stack::Storage& storage, typename P::Counter& counter,
                                    Visit&& visit) {
  using Lanes = typename P::Lanes;
  using Node = typename P::Layout::Node;
  using Leaf = typename P::Layout::Leaf;
  const RaySlabs<Lanes> slabs(ray, P::Boxes::margin(ray.origin, scene.bounds));
  const typename P::Triangle::template PreparedRay<Lanes> prepared(ray);
  const typename Lanes::Float tmin = Lanes::all(max_of(ray.tmin, 0.0f));
  typename P::Stack stack(storage);
  NodeRef ref = scene.root;
  for (;;) {
    bool descend = true;
    if (is_box(ref)) {
      counter.on_boxes();
      const Node& node = *reinterpret_cast<const Node*>(scene.base + ref_offset(ref));
      const BoxHits<Lanes> hits = intersect_boxes<Lanes>(node, slabs, tmin, Lanes::all(limit));
      descend = hits.mask != 0;
      if (descend) ref = Order::next(node.child, hits, stack);
    } else {
      const Leaf* leaf = reinterpret_cast<const Leaf*>(scene.base + ref_offset(ref));
      for (;; ++leaf) {
        counter.on_leaf(leaf->info.primitive[1] == kInvalidId ? 1u : 2u);
        if (!visit(*leaf, prepared)) return;
        if ((leaf->info.geometry_and_flags & kLastInRun) != 0) break;
      }
      descend = false;
    }
    while (!descend) {
      if (stack.empty()) return;
      const StackEntry entry = stack.pop();
      descend = entry_distance(entry) <= limit;
      ref = entry_ref(entry);
    }
  }
}

/// Whether the ray sees the geometry.
template <class P>
HIPRT_HD HIPRT_INLINE bool is_visible(const SceneView& scene, const Ray& ray, std::uint32_t geometry) {
  if constexpr ((P::kFeatures & feature_bit(Feature::kMasks)) != 0)
    return (scene.features & feature_bit(Feature::kMasks)) == 0 || (scene.geometries[geometry].mask & ray.mask) != 0;
  return true;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
