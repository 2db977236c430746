#pragma once
/// The position of a ray in a scene of instances: in the scene itself or in an object, and through which instances.

#include <hiprt_device/instances/level_memory.h>
#include <hiprt_device/instances/object_view.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The ray of a query.
///
/// Tracers of instances have it in the memory of the stack's Storage. They need it only when they enter or leave an
/// instance, and registers limit their occupancy.
template <unsigned kLevels, class Real> class QueryRay {
 public:
  template <class Storage>
  HIPRT_HD HIPRT_FORCE_INLINE QueryRay(const BasicRay<Real>& ray, const Storage& storage)
      : path_memory_(storage.path_memory) {
    stack_detail::in_memory(path_memory_).ray.get() = ray;
  }
  HIPRT_HD HIPRT_FORCE_INLINE const BasicRay<Real>& get() const {
    return stack_detail::in_memory(path_memory_).ray.get();
  }

 private:
  PathMemory<kLevels, Real>* path_memory_;
};
template <class Real> class QueryRay<0, Real> {
 public:
  template <class Storage>
  HIPRT_HD HIPRT_FORCE_INLINE QueryRay(const BasicRay<Real>& ray, const Storage&) : ray_(ray) {}
  HIPRT_HD HIPRT_FORCE_INLINE const BasicRay<Real>& get() const { return ray_; }

 private:
  BasicRay<Real> ray_;
};

namespace levels_detail {

/// State of more than one level. The path, and the ray as each object on it sees it, lie in memory of the stack's
/// Storage (LevelStack). To follow the path again would be a chain of dependent loads.
template <unsigned kLevels, class Real> struct LevelState {
  const std::byte* base;
  const ObjectRecord* object = nullptr;  ///< nullptr: the scene.
  PathMemory<kLevels, Real>* path_memory;
  std::uint32_t depth = 0;
};
/// One level needs one number.
template <class Real> struct LevelState<1, Real> {
  const std::byte* base;
  PathMemory<1, Real>* path_memory;
  std::uint32_t instance = kInvalidId;
};
template <class Real> struct LevelState<0, Real> {};

}  // namespace levels_detail

/// The position of a traversal in a scene. With kLevels = 0 everything is the scene's and costs nothing.
/// @tparam kLevels nested instances that a ray may be in.
/// @tparam kMoves whether instances may move.
/// @tparam Real of the rays.
template <unsigned kLevels, bool kMoves, class Real = float> class Levels {
 public:
  template <class Storage>
  HIPRT_HD HIPRT_FORCE_INLINE Levels([[maybe_unused]] const SceneView& scene, [[maybe_unused]] const Storage& storage) {
    if constexpr (kLevels != 0) {
      state_.base = scene.base;
      state_.path_memory = storage.path_memory;
    }
  }

  /// First byte of the file that the ray is in.
  HIPRT_HD HIPRT_FORCE_INLINE const std::byte* base([[maybe_unused]] const SceneView& scene) const {
    if constexpr (kLevels == 0)
      return scene.base;
    else
      return state_.base;
  }
  /// nullptr: the ray is in an object of triangles and custom primitives.
  HIPRT_HD HIPRT_FORCE_INLINE const InstanceRecord* instances(const SceneView& scene) const {
    if constexpr (kLevels == 0) {
      return nullptr;
    } else if constexpr (kLevels == 1) {
      return depth() == 0 ? scene.instances : nullptr;
    } else {
      if (state_.object == nullptr) return scene.instances;
      return state_.object->instances == 0
                 ? nullptr
                 : reinterpret_cast<const InstanceRecord*>(state_.base + state_.object->instances);
    }
  }
  HIPRT_HD HIPRT_FORCE_INLINE const GeometryRecord& geometry(const SceneView& scene, std::uint32_t i) const {
    if constexpr (kLevels == 0) {
      return scene.geometries[i];
    } else if constexpr (kLevels == 1) {
      if (depth() == 0) return scene.geometries[i];
      const ObjectRecord& object = scene.objects[scene.instances[state_.instance].object];
      return reinterpret_cast<const GeometryRecord*>(state_.base + object.geometries)[i];
    } else {
      return state_.object == nullptr
                 ? scene.geometries[i]
                 : reinterpret_cast<const GeometryRecord*>(state_.base + state_.object->geometries)[i];
    }
  }

  /// The ray as the object sees it.
  HIPRT_HD HIPRT_FORCE_INLINE decltype(auto) ray([[maybe_unused]] const SceneView& scene,
                                                 const BasicRay<Real>& of_scene) const {
    if constexpr (kLevels == 0)
      return (of_scene);
    else if constexpr (kLevels == 1)
      return depth() == 0 ? of_scene : ray_into(scene, state_.instance, of_scene);
    else
      return entered_ray(of_scene);
  }
  /// The same before the ray enters an instance.
  HIPRT_HD HIPRT_FORCE_INLINE decltype(auto) ray_before(const SceneView&, const BasicRay<Real>& of_scene) const {
    if constexpr (kLevels <= 1)  // Only the scene itself has instances.
      return (of_scene);
    else
      return entered_ray(of_scene);
  }
  /// A ray of the object at hand, as an instance of it sees it.
  HIPRT_HD HIPRT_FORCE_INLINE BasicRay<Real> ray_into(const SceneView& scene, std::uint32_t instance,
                                                      const BasicRay<Real>& of_object) const {
    if constexpr (kLevels == 1) {
      return ObjectView(scene).template ray_into<kMoves>(instance, of_object);
    } else {
      const ObjectView view = state_.object == nullptr ? ObjectView(scene) : ObjectView(scene, *state_.object);
      return view.template ray_into<kMoves>(instance, of_object);
    }
  }

  HIPRT_HD HIPRT_FORCE_INLINE InstancePath<kLevels> path() const {
    if constexpr (kLevels == 0) {
      return {};
    } else if constexpr (kLevels == 1) {
      return {depth(), {depth() == 0 ? 0 : state_.instance}};
    } else {
      return path_of<kLevels>(state_.depth, state_.path_memory->instance);
    }
  }
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t depth() const {
    if constexpr (kLevels == 0)
      return 0;
    else if constexpr (kLevels == 1)
      return state_.instance == kInvalidId ? 0 : 1;
    else
      return state_.depth;
  }
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t instance([[maybe_unused]] unsigned level) const {
    if constexpr (kLevels == 1)
      return state_.instance;
    else
      return state_.path_memory->instance[level];
  }
  /// InstanceRecord::id of an instance of the path. Called where depth() is more than @p level.
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t instance_id([[maybe_unused]] const SceneView& scene,
                                                        [[maybe_unused]] unsigned level) const {
    if constexpr (kLevels == 0) {
      return kInvalidId;
    } else if constexpr (kLevels == 1) {
      return scene.instances[state_.instance].id;
    } else {
      const InstanceRecord* instances = scene.instances;
      if (level != 0) {
        const ObjectRecord& outside = *state_.path_memory->entered[level - 1].object;
        instances = reinterpret_cast<const InstanceRecord*>(scene.base + outside.offset + outside.instances);
      }
      return instances[state_.path_memory->instance[level]].id;
    }
  }
  /// nullptr: the scene. With one level always nullptr: the traversal does not need it.
  HIPRT_HD HIPRT_FORCE_INLINE const ObjectRecord* object() const {
    if constexpr (kLevels <= 1)
      return nullptr;
    else
      return state_.object;
  }
  /// In the scene's table; kInvalidId: the scene.
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t object_number([[maybe_unused]] const SceneView& scene) const {
    if constexpr (kLevels == 0)
      return kInvalidId;
    else if constexpr (kLevels == 1)
      return depth() == 0 ? kInvalidId : scene.instances[state_.instance].object;
    else
      return state_.object == nullptr ? kInvalidId : static_cast<std::uint32_t>(state_.object - scene.objects);
  }
  /// An instance of the path has InstanceFlags::kNoFilter.
  HIPRT_HD HIPRT_FORCE_INLINE bool without_filter(const SceneView& scene) const {
    if constexpr (kLevels == 1) {
      return depth() != 0 && (scene.instances[state_.instance].flags & InstanceFlags::kNoFilter) != 0;
    } else {
      ObjectView view(scene);
      for (unsigned i = 0; i < state_.depth; ++i) {
        const InstanceRecord& record = view.instances[state_.path_memory->instance[i]];
        if ((record.flags & InstanceFlags::kNoFilter) != 0) return true;
        view = ObjectView(scene, scene.objects[record.object]);
      }
      return false;
    }
  }

  /// @param local the ray as the object sees it.
  HIPRT_HD HIPRT_FORCE_INLINE void enter(const SceneView& scene, std::uint32_t instance, const ObjectRecord& object,
                                         [[maybe_unused]] const BasicRay<Real>& local) {
    if constexpr (kLevels == 1) {
      state_.instance = instance;
    } else {
      state_.path_memory->instance[state_.depth] = instance;
      state_.path_memory->entered[state_.depth++] = {&object,
                                                     {local.origin.x, local.origin.y, local.origin.z},
                                                     {local.direction.x, local.direction.y, local.direction.z}};
      state_.object = &object;
    }
    state_.base = scene.base + object.offset;
  }
  HIPRT_HD HIPRT_FORCE_INLINE void leave(const SceneView& scene) {
    if constexpr (kLevels == 1) {
      restart(scene);
    } else {
      --state_.depth;
      state_.object = state_.depth == 0 ? nullptr : state_.path_memory->entered[state_.depth - 1].object;
      state_.base = scene.base + (state_.depth == 0 ? 0 : state_.object->offset);
    }
  }
  HIPRT_HD HIPRT_FORCE_INLINE void restart(const SceneView& scene) {
    if constexpr (kLevels == 1) {
      state_.instance = kInvalidId;
    } else {
      state_.object = nullptr;
      state_.depth = 0;
    }
    state_.base = scene.base;
  }
  /// The memory that keeps the slabs outside an instance while the ray is in it.
  HIPRT_HD HIPRT_FORCE_INLINE SavedSlabs& slabs() const {
    return stack_detail::in_memory(state_.path_memory).outside[kLevels == 1 ? 0 : depth()];
  }

 private:
  HIPRT_HD HIPRT_FORCE_INLINE BasicRay<Real> entered_ray(const BasicRay<Real>& of_scene) const {
    BasicRay<Real> ray = of_scene;
    if (state_.depth == 0) return ray;
    const EnteredObject<Real>& at = state_.path_memory->entered[state_.depth - 1];
    ray.origin = {at.origin[0], at.origin[1], at.origin[2]};
    ray.direction = {at.direction[0], at.direction[1], at.direction[2]};
    return ray;
  }

  levels_detail::LevelState<kLevels, Real> state_;
};

/// Whether a ray sees a geometry of the file that it is in.
template <class P>
HIPRT_HD HIPRT_FORCE_INLINE bool is_visible(const SceneView& scene,
                                            const Levels<P::kLevels, P::kMoves, typename P::Real>& levels,
                                            const BasicRay<typename P::Real>& ray, std::uint32_t geometry) {
  if constexpr ((P::kFeatures & feature_bit(Feature::kMasks)) != 0)
    return (scene.features & feature_bit(Feature::kMasks)) == 0 ||
           (levels.geometry(scene, geometry).mask & ray.mask) != 0;
  return true;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
