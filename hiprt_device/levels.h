#pragma once
/// Where a ray is in a scene of instances: in the scene itself or in an object, and on which way.

#include <hiprt_device/instance.h>
#include <hiprt_device/scene_view.h>

#include <type_traits>

namespace hiprt {

/// The instances on the way from a scene to a primitive, the outermost first. Numbers are indices of InstanceRecord in
/// the file that has the instance (SceneView::instances for the first).
template <unsigned kLevels> struct InstancePath {
  std::uint32_t depth = 0;  ///< Instances on the way; in a scene without instances 0.
  std::uint32_t instance[kLevels] = {};

  /// In the order of the numbers, a way before those that it begins.
  HIPRT_HD friend bool operator<(const InstancePath& a, const InstancePath& b) {
    for (unsigned i = 0; i < kLevels; ++i) {
      if (i >= a.depth || i >= b.depth) return a.depth < b.depth;
      if (a.instance[i] != b.instance[i]) return a.instance[i] < b.instance[i];
    }
    return false;
  }
  HIPRT_HD friend bool operator==(const InstancePath& a, const InstancePath& b) { return !(a < b) && !(b < a); }
};
/// Of policies without levels.
template <> struct InstancePath<0> {
  static constexpr std::uint32_t depth = 0;
  HIPRT_HD friend constexpr bool operator<(InstancePath, InstancePath) { return false; }
  HIPRT_HD friend constexpr bool operator==(InstancePath, InstancePath) { return true; }
};

/// A hit in a scene of instances. Normal and error are the scene's; geometry and primitive are the object's at the end
/// of the way; t, u and v are the same in both.
template <unsigned kLevels> struct PathHit : Hit { InstancePath<kLevels> path{}; };

/// What queries answer: of policies without levels a bare Hit.
template <unsigned kLevels> using HitOf = std::conditional_t<kLevels == 0, Hit, PathHit<kLevels>>;

inline namespace HIPRT_ISA_NAMESPACE {

/// The BVH that a ray is in: the scene's, or an object's.
struct ObjectPlace {
  const std::byte* base;  ///< Of its file; node references count from here.
  const GeometryRecord* geometries;
  const InstanceRecord* instances;  ///< nullptr: it has triangles and custom primitives.

  HIPRT_HD HIPRT_INLINE explicit ObjectPlace(const SceneView& scene)
      : base(scene.base), geometries(scene.geometries), instances(scene.instances) {}
  HIPRT_HD HIPRT_INLINE ObjectPlace(const SceneView& scene, const ObjectRecord& object)
      : base(scene.base + object.offset),
        geometries(reinterpret_cast<const GeometryRecord*>(base + object.geometries)),
        instances(object.instances == 0 ? nullptr : reinterpret_cast<const InstanceRecord*>(base + object.instances)) {}
};

/// visit(record, object) for the instances of a way, from the scene inwards. @return where it ends.
template <unsigned kLevels, class Visit>
HIPRT_HD HIPRT_INLINE ObjectPlace follow(const SceneView& scene, const InstancePath<kLevels>& path, Visit&& visit) {
  ObjectPlace place(scene);
  if constexpr (kLevels != 0) {
    for (unsigned i = 0; i < path.depth; ++i) {
      const InstanceRecord& record = place.instances[path.instance[i]];
      const ObjectRecord& object = scene.objects[record.object];
      visit(record, object);
      place = ObjectPlace(scene, object);
    }
  }
  return place;
}

/// The ray at the end of a way.
template <unsigned kLevels>
HIPRT_HD HIPRT_INLINE Ray ray_along(const SceneView& scene, const InstancePath<kLevels>& path, Ray ray) {
  follow(scene, path, [&](const InstanceRecord& record, const ObjectRecord&) { ray = ray_to_object(record, ray); });
  return ray;
}

/// What a traversal knows of where it is. The ray that it is given is the scene's.
template <unsigned kLevels> class Levels {
 public:
  HIPRT_HD HIPRT_INLINE Levels(const SceneView& scene, const Ray& ray) : place_(scene), local_(ray) {}

  HIPRT_HD HIPRT_INLINE const ObjectPlace& place(const SceneView&) const { return place_; }
  /// As the object sees it.
  HIPRT_HD HIPRT_INLINE const Ray& ray(const Ray&) const { return local_; }
  HIPRT_HD HIPRT_INLINE const InstancePath<kLevels>& path() const { return path_; }

  /// @param local the ray as the object sees it.
  HIPRT_HD HIPRT_INLINE void enter(const SceneView& scene, std::uint32_t instance, const ObjectRecord& object,
                                   const Ray& local) {
    if constexpr (kLevels == 1)
      path_.instance[0] = instance;
    else
      path_.instance[path_.depth] = instance;
    ++path_.depth;
    place_ = ObjectPlace(scene, object);
    local_ = local;
  }
  /// Rays are not kept on the way in: the scene's is transformed again, which gives the same bits.
  /// @return the object outside; nullptr: the scene.
  HIPRT_HD HIPRT_INLINE const ObjectRecord* leave(const SceneView& scene, const Ray& ray) {
    const ObjectRecord* outside = nullptr;
    --path_.depth;
    local_ = ray;
    place_ = ObjectPlace(scene);
    if constexpr (kLevels > 1)
      place_ = follow(scene, path_, [&](const InstanceRecord& record, const ObjectRecord& object) {
        local_ = ray_to_object(record, local_);
        outside = &object;
      });
    return outside;
  }
  HIPRT_HD HIPRT_INLINE void restart(const SceneView& scene, const Ray& ray) { *this = Levels(scene, ray); }

 private:
  ObjectPlace place_;
  Ray local_;
  InstancePath<kLevels> path_{};
};

/// Of policies without levels: nothing.
template <> class Levels<0> {
 public:
  HIPRT_HD HIPRT_INLINE Levels(const SceneView&, const Ray&) {}
  HIPRT_HD HIPRT_INLINE ObjectPlace place(const SceneView& scene) const { return ObjectPlace(scene); }
  HIPRT_HD HIPRT_INLINE const Ray& ray(const Ray& of_scene) const { return of_scene; }
  HIPRT_HD HIPRT_INLINE InstancePath<0> path() const { return {}; }
  HIPRT_HD HIPRT_INLINE void restart(const SceneView&, const Ray&) {}
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
