#pragma once
/// A scene that is one instance, traced by policies without levels: rays go into the object before, and hits come back
/// behind.

#include <hiprt_device/intersect/hit_surface.h>
#include <hiprt_device/scene_view.h>

#include <optional>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// An object and the one instance of it that a scene consists of. Kernels for flat scenes trace it as fast as the
/// object alone, but for two transforms per ray; those of one level have code for all that other scenes may have.
///
///     const auto placed = hiprt::only_instance(view);  // of the file
///     hiprt::Hit hit = hiprt::closest_hit<hiprt::Policies<>>(placed->object, placed->to_object(ray));
///     hiprt::PathHit<1> in_scene = placed->to_scene(hit, ray);
///
/// The answers are those of Instanced<Policies<>>, bit by bit. Filters and custom primitives of a flat tracer see rays
/// and hits as the object does.
struct PlacedObject {
  SceneView scene;         ///< What the instance is in.
  SceneView object;        ///< Of triangles and custom primitives.
  std::uint32_t instance;  ///< Of scene.instances.

  /// A ray that the instance's mask hides it from has no mask, and hits nothing.
  HIPRT_HD HIPRT_INLINE Ray to_object(const Ray& ray) const {
    const InstanceRecord record = load_record(scene.instances[instance]);
    Ray local = ray_to_object(record, ray);
    if ((record.mask & ray.mask) == 0) local.mask = 0;
    return local;
  }
  /// An answer of object, with its way.
  HIPRT_HD HIPRT_INLINE PathHit<1> with_path(const Hit& hit) const {
    PathHit<1> result;
    static_cast<Hit&>(result) = hit;
    if (hit.found()) result.path = {1, {instance}};
    return result;
  }
  /// The same with normal and error bound as the scene sees them. @param hit with those of the object (closest hits).
  /// @param ray the scene's.
  HIPRT_HD HIPRT_INLINE PathHit<1> to_scene(const Hit& hit, const Ray& ray) const {
    PathHit<1> result = with_path(hit);
    if (hit.found()) complete_along<false>(scene, result, ray, [](const Ray&, const std::byte*) {});
    return result;
  }
};

/// @param view of a file that validate() accepts, on the host. @param device_base as in make_scene_view().
/// @return nothing if the scene is not one whole instance, of an object without instances, that stands still.
inline std::optional<PlacedObject> only_instance(const BufferView& view, const std::byte* device_base = nullptr) {
  const NodeRef root = view.header->root;
  if (!view.has_instances() || is_box(root) || is_end(root) || view.header->levels != 1) return std::nullopt;
  if ((view.header->features & (feature_bit(Feature::kMotion) | feature_bit(Feature::kMovingBoxes))) != 0)
    return std::nullopt;
  const LeafInfo& info = reinterpret_cast<const CustomLeaf*>(view.bytes.data() + ref_offset(root))->info;
  const ObjectRecord& record = view.objects[view.instances[info.primitive[0]].object];
  // A run of one leaf, which leads to the object's root.
  if ((info.geometry_and_flags & kLastInRun) == 0 || entered_ref(info) != record.root) return std::nullopt;
  const auto object = open_buffer(view.object_file(record));
  if (!object) return std::nullopt;
  const std::byte* base = device_base != nullptr ? device_base : view.bytes.data();
  return PlacedObject{make_scene_view(view, device_base), make_scene_view(*object, base + record.offset),
                      info.primitive[0]};
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
