#pragma once
/// A scene that is one instance, traced by policies without levels. Rays are transformed to the object, and hits back
/// to the scene.

#include <hiprt_device/instances/instance_surface.h>
#include <hiprt_device/scene_view.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// An object and the only instance of a scene.
///
/// Kernels for flat scenes trace it as fast as the object alone, plus two transforms per ray. Kernels with one level
/// also have code for what other scenes may contain.
///
///     const auto placed = hiprt::only_instance(view);  // of the file
///     hiprt::Hit hit = hiprt::closest_hit<hiprt::Policies>(placed->object, placed->to_object(ray));
///     hiprt::PathHit<1> in_scene = placed->to_scene(hit, ray);
///
/// The results are those of Instanced<Policies>, bit by bit. Filters and custom primitives of a flat tracer see rays
/// and hits as the object does.
struct PlacedObject {
  SceneView scene;         ///< The scene that has the instance.
  SceneView object;        ///< The object; it has triangles and custom primitives.
  std::uint32_t instance;  ///< Index in scene.instances.

  /// The ray as the object sees it. If the instance's mask hides it from the ray, the result has mask 0 and hits
  /// nothing.
  HIPRT_HD HIPRT_FORCE_INLINE Ray to_object(const Ray& ray) const {
    const InstanceRecord record = load_record(scene.instances[instance]);
    Ray local = ray_to_object(record, ray);
    if ((record.mask & ray.mask) == 0) local.mask = 0;
    return local;
  }
  /// A hit in the object, with the path.
  HIPRT_HD HIPRT_FORCE_INLINE PathHit<1> with_path(const Hit& hit) const {
    PathHit<1> result;
    static_cast<Hit&>(result) = hit;
    if (hit.found()) result.path = {1, {instance}};
    return result;
  }
  /// A hit in the object with the path, and with normal and error bound as the scene sees them.
  /// @param hit with normal and error bound of the object (closest hits).
  /// @param ray the scene's.
  HIPRT_HD HIPRT_FORCE_INLINE PathHit<1> to_scene(const Hit& hit, const Ray& ray) const {
    PathHit<1> result = with_path(hit);
    if (hit.found()) complete_along<false>(scene, result, ray, [](const Ray&, const std::byte*) {});
    return result;
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
