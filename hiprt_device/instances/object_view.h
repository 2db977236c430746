#pragma once
/// The files of a scene and of its objects, single or along a path of instances.

#include <hiprt_device/instances/instance_path.h>
#include <hiprt_device/instances/motion.h>
#include <hiprt_device/instances/transform.h>
#include <hiprt_device/scene_view.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The BVH that a ray is in, with the tables of its file: the scene's or an object's.
struct ObjectView {
  const std::byte* base;  ///< First byte of its file; node references count from there.
  const GeometryRecord* geometries;
  const InstanceRecord* instances;  ///< nullptr: the file has triangles and custom primitives.
  const MotionRecord* motions;      ///< nullptr: none of the file's instances moves.

  HIPRT_HD HIPRT_FORCE_INLINE explicit ObjectView(const SceneView& scene)
      : base(scene.base), geometries(scene.geometries), instances(scene.instances), motions(scene.motions) {}
  HIPRT_HD HIPRT_FORCE_INLINE ObjectView(const SceneView& scene, const ObjectRecord& object)
      : base(scene.base + object.offset),
        geometries(reinterpret_cast<const GeometryRecord*>(base + object.geometries)),
        instances(object.instances == 0 ? nullptr : reinterpret_cast<const InstanceRecord*>(base + object.instances)),
        motions(object.motions == 0 ? nullptr : reinterpret_cast<const MotionRecord*>(base + object.motions)) {}

  /// Instance @p i at a time.
  /// @tparam kMoves false: instances stand still, and the record is the file's.
  template <bool kMoves> HIPRT_HD HIPRT_FORCE_INLINE decltype(auto) instance(std::uint32_t i, float time) const {
    if constexpr (kMoves)
      return motions == nullptr ? instances[i] : at_time(instances[i], motions[i], base, time);
    else
      return (instances[i]);
  }
  /// A ray as instance @p i sees it.
  template <bool kMoves, class Real>
  HIPRT_HD HIPRT_FORCE_INLINE BasicRay<Real> ray_into(std::uint32_t i, const BasicRay<Real>& ray) const {
    if constexpr (kMoves)
      if (motions != nullptr) return ray_to_object(at_time(instances[i], motions[i], base, ray.time), ray);
    return ray_to_object(load_record(instances[i]), ray);
  }
  /// The motion of instance @p i; nullptr: it stands still.
  template <bool kMoves> HIPRT_HD HIPRT_FORCE_INLINE const MotionRecord* motion(std::uint32_t i) const {
    return kMoves && motions != nullptr && motions[i].count != 0 ? &motions[i] : nullptr;
  }
};

/// Calls visit(record, object, motion) for the instances of a path, the outermost first, at a time. motion is nullptr
/// for instances that do not move.
/// @param visit may take the number of the instance on the path, too.
/// @return the BVH at the end of the path.
/// @tparam kMoves false: for scenes where nothing moves.
template <bool kMoves = true, unsigned kLevels, class Visit>
HIPRT_HD HIPRT_FORCE_INLINE ObjectView follow(const SceneView& scene, const InstancePath<kLevels>& path, float time,
                                              Visit&& visit) {
  ObjectView view(scene);
  if constexpr (kLevels != 0) {
    for_levels<kLevels>(path.depth, [&](unsigned i) HIPRT_FORCE_INLINE_LAMBDA {
      const std::uint32_t instance = path.instance[i];
      // A path continues only where there are instances. NOLINTNEXTLINE(clang-analyzer-core.NullDereference)
      const ObjectRecord& object = scene.objects[view.instances[instance].object];
      const MotionRecord* const motion = view.template motion<kMoves>(instance);
      if constexpr (requires { visit(view.instances[instance], object, motion, i); })
        visit(view.template instance<kMoves>(instance, time), object, motion, i);
      else
        visit(view.template instance<kMoves>(instance, time), object, motion);
      view = ObjectView(scene, object);
    });
  }
  return view;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
