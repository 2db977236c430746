#pragma once
/// Where a ray is in a scene of instances: in the scene itself or in an object, and on which way.

#include <hiprt_device/instances/motion.h>
#include <hiprt_device/instances/transform.h>
#include <hiprt_device/scene_view.h>
#include <hiprt_device/traverse/stacks/level_stack.h>

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
template <class Real, unsigned kLevels> struct BasicPathHit : BasicHit<Real> { InstancePath<kLevels> path{}; };
template <unsigned kLevels> using PathHit = BasicPathHit<float, kLevels>;

/// What queries answer: of policies without levels a bare Hit.
template <class Real, unsigned kLevels>
using HitOf = std::conditional_t<kLevels == 0, BasicHit<Real>, BasicPathHit<Real, kLevels>>;

inline namespace HIPRT_ISA_NAMESPACE {

/// The BVH that a ray is in: the scene's, or an object's.
struct ObjectPlace {
  const std::byte* base;  ///< Of its file; node references count from here.
  const GeometryRecord* geometries;
  const InstanceRecord* instances;  ///< nullptr: it has triangles and custom primitives.
  const MotionRecord* motions;      ///< nullptr: no instance of its own moves.

  HIPRT_HD HIPRT_INLINE explicit ObjectPlace(const SceneView& scene)
      : base(scene.base), geometries(scene.geometries), instances(scene.instances), motions(scene.motions) {}
  HIPRT_HD HIPRT_INLINE ObjectPlace(const SceneView& scene, const ObjectRecord& object)
      : base(scene.base + object.offset),
        geometries(reinterpret_cast<const GeometryRecord*>(base + object.geometries)),
        instances(object.instances == 0 ? nullptr : reinterpret_cast<const InstanceRecord*>(base + object.instances)),
        motions(object.motions == 0 ? nullptr : reinterpret_cast<const MotionRecord*>(base + object.motions)) {}

  /// Instance @p i, as it is at a time.
  /// @tparam kMoves false: instances stand still, and the record is the file's.
  template <bool kMoves> HIPRT_HD HIPRT_INLINE decltype(auto) instance(std::uint32_t i, float time) const {
    if constexpr (kMoves)
      return motions == nullptr ? instances[i] : at_time(instances[i], motions[i], base, time);
    else
      return (instances[i]);
  }
  /// A ray, as instance @p i sees it.
  template <bool kMoves, class Real>
  HIPRT_HD HIPRT_INLINE BasicRay<Real> ray_into(std::uint32_t i, const BasicRay<Real>& ray) const {
    if constexpr (kMoves)
      return ray_to_object(instance<kMoves>(i, ray.time), ray);
    else
      return ray_to_object(load_record(instances[i]), ray);
  }
  /// Its motion; nullptr: it stands still.
  template <bool kMoves> HIPRT_HD HIPRT_INLINE const MotionRecord* motion(std::uint32_t i) const {
    return kMoves && motions != nullptr && motions[i].count != 0 ? &motions[i] : nullptr;
  }
};

/// visit(record, object, motion) for the instances of a way, from the scene inwards: as they are at a time, with their
/// MotionRecord, nullptr for those that stand still. @return where it ends.
/// @tparam kMoves false: for scenes where nothing moves.
template <bool kMoves = true, unsigned kLevels, class Visit>
HIPRT_HD HIPRT_INLINE ObjectPlace follow(const SceneView& scene, const InstancePath<kLevels>& path, float time,
                                         Visit&& visit) {
  ObjectPlace place(scene);
  if constexpr (kLevels != 0) {
    for (unsigned i = 0; i < path.depth; ++i) {
      const std::uint32_t instance = path.instance[i];
      // A way goes on only where there are instances. NOLINTNEXTLINE(clang-analyzer-core.NullDereference)
      const ObjectRecord& object = scene.objects[place.instances[instance].object];
      visit(place.template instance<kMoves>(instance, time), object, place.template motion<kMoves>(instance));
      place = ObjectPlace(scene, object);
    }
  }
  return place;
}

/// The ray of a query. Tracers of instances have it in the memory of the stack's Storage: they need it on the ways in
/// and out only, and registers are what limits them.
template <unsigned kLevels, class Real> class KeptRay {
 public:
  template <class Storage>
  HIPRT_HD HIPRT_INLINE KeptRay(const BasicRay<Real>& ray, const Storage& storage) : ways_(storage.ways) {
    stack_detail::in_memory(ways_).ray.get() = ray;
  }
  HIPRT_HD HIPRT_INLINE const BasicRay<Real>& get() const { return stack_detail::in_memory(ways_).ray.get(); }

 private:
  LevelWays<kLevels, Real>* ways_;
};
template <class Real> class KeptRay<0, Real> {
 public:
  template <class Storage> HIPRT_HD HIPRT_INLINE KeptRay(const BasicRay<Real>& ray, const Storage&) : ray_(ray) {}
  HIPRT_HD HIPRT_INLINE const BasicRay<Real>& get() const { return ray_; }

 private:
  BasicRay<Real> ray_;
};

/// What a traversal knows of where it is.
/// @tparam kLevels more than 1: the way, and the ray as each object on it sees it, lie in memory of the stack's Storage
/// (LevelStack): to follow the way again would be a chain of loads that wait for each other.
/// @tparam kMoves whether instances may move.
/// @tparam Real of the rays.
template <unsigned kLevels, bool kMoves, class Real = float> class Levels {
 public:
  template <class Storage>
  HIPRT_HD HIPRT_INLINE Levels(const SceneView& scene, const Storage& storage)
      : base_(scene.base), ways_(storage.ways) {}

  /// First byte of the file that the ray is in.
  HIPRT_HD HIPRT_INLINE const std::byte* base(const SceneView&) const { return base_; }
  /// nullptr: the ray is in an object of triangles and custom primitives.
  HIPRT_HD HIPRT_INLINE const InstanceRecord* instances(const SceneView& scene) const {
    if (object_ == nullptr) return scene.instances;
    return object_->instances == 0 ? nullptr : reinterpret_cast<const InstanceRecord*>(base_ + object_->instances);
  }
  HIPRT_HD HIPRT_INLINE const GeometryRecord& geometry(const SceneView& scene, std::uint32_t i) const {
    return object_ == nullptr ? scene.geometries[i]
                              : reinterpret_cast<const GeometryRecord*>(base_ + object_->geometries)[i];
  }
  /// As the object sees it.
  HIPRT_HD HIPRT_INLINE BasicRay<Real> ray(const SceneView&, const BasicRay<Real>& of_scene) const {
    BasicRay<Real> ray = of_scene;
    if (depth_ == 0) return ray;
    const EnteredObject<Real>& at = ways_->entered[depth_ - 1];
    ray.origin = {at.origin[0], at.origin[1], at.origin[2]};
    ray.direction = {at.direction[0], at.direction[1], at.direction[2]};
    return ray;
  }
  /// The same before the ray enters an instance.
  HIPRT_HD HIPRT_INLINE BasicRay<Real> ray_before(const SceneView& scene, const BasicRay<Real>& of_scene) const {
    return ray(scene, of_scene);
  }
  /// A ray of the object at hand, as an instance of it sees it.
  HIPRT_HD HIPRT_INLINE BasicRay<Real> ray_into(const SceneView& scene, std::uint32_t instance,
                                                const BasicRay<Real>& of_object) const {
    const ObjectPlace place = object_ == nullptr ? ObjectPlace(scene) : ObjectPlace(scene, *object_);
    return place.template ray_into<kMoves>(instance, of_object);
  }
  HIPRT_HD HIPRT_INLINE InstancePath<kLevels> path() const {
    InstancePath<kLevels> path;
    path.depth = depth_;
    for (unsigned i = 0; i < depth_; ++i) path.instance[i] = ways_->instance[i];
    return path;
  }
  HIPRT_HD HIPRT_INLINE std::uint32_t depth() const { return depth_; }
  HIPRT_HD HIPRT_INLINE std::uint32_t instance(unsigned level) const { return ways_->instance[level]; }

  /// An instance on the way has InstanceFlags::kNoFilter.
  HIPRT_HD HIPRT_INLINE bool without_filter(const SceneView& scene) const {
    ObjectPlace place(scene);
    for (unsigned i = 0; i < depth_; ++i) {
      const InstanceRecord& record = place.instances[ways_->instance[i]];
      if ((record.flags & InstanceFlags::kNoFilter) != 0) return true;
      place = ObjectPlace(scene, scene.objects[record.object]);
    }
    return false;
  }
  /// @param local the ray as the object sees it.
  HIPRT_HD HIPRT_INLINE void enter(const SceneView& scene, std::uint32_t instance, const ObjectRecord& object,
                                   const BasicRay<Real>& local) {
    ways_->instance[depth_] = instance;
    ways_->entered[depth_++] = {&object,
                                {local.origin.x, local.origin.y, local.origin.z},
                                {local.direction.x, local.direction.y, local.direction.z}};
    object_ = &object;
    base_ = scene.base + object.offset;
  }
  HIPRT_HD HIPRT_INLINE void leave(const SceneView& scene) {
    --depth_;
    object_ = depth_ == 0 ? nullptr : ways_->entered[depth_ - 1].object;
    base_ = scene.base + (depth_ == 0 ? 0 : object_->offset);
  }
  /// For the ray's slabs where it is now, before it enters an instance and when it has left it.
  HIPRT_HD HIPRT_INLINE KeptSlabs& slabs() const { return stack_detail::in_memory(ways_).outside[depth_]; }
  /// nullptr: the scene.
  HIPRT_HD HIPRT_INLINE const ObjectRecord* object() const { return object_; }
  /// In the scene's table; kInvalidId: the scene.
  HIPRT_HD HIPRT_INLINE std::uint32_t object_number(const SceneView& scene) const {
    return object_ == nullptr ? kInvalidId : static_cast<std::uint32_t>(object_ - scene.objects);
  }
  HIPRT_HD HIPRT_INLINE void restart(const SceneView& scene) {
    base_ = scene.base;
    object_ = nullptr;
    depth_ = 0;
  }

 private:
  const std::byte* base_;
  const ObjectRecord* object_ = nullptr;
  LevelWays<kLevels, Real>* ways_;
  std::uint32_t depth_ = 0;
};

/// One level needs one number.
template <bool kMoves, class Real> class Levels<1, kMoves, Real> {
 public:
  template <class Storage>
  HIPRT_HD HIPRT_INLINE Levels(const SceneView& scene, const Storage& storage)
      : base_(scene.base), ways_(storage.ways) {}

  HIPRT_HD HIPRT_INLINE const std::byte* base(const SceneView&) const { return base_; }
  HIPRT_HD HIPRT_INLINE const InstanceRecord* instances(const SceneView& scene) const {
    return depth() == 0 ? scene.instances : nullptr;
  }
  HIPRT_HD HIPRT_INLINE const GeometryRecord& geometry(const SceneView& scene, std::uint32_t i) const {
    if (depth() == 0) return scene.geometries[i];
    const ObjectRecord& object = scene.objects[scene.instances[instance_].object];
    return reinterpret_cast<const GeometryRecord*>(base_ + object.geometries)[i];
  }
  HIPRT_HD HIPRT_INLINE BasicRay<Real> ray(const SceneView& scene, const BasicRay<Real>& of_scene) const {
    return depth() == 0 ? of_scene : ray_into(scene, instance_, of_scene);
  }
  /// Instances are in the scene only.
  HIPRT_HD HIPRT_INLINE const BasicRay<Real>& ray_before(const SceneView&, const BasicRay<Real>& of_scene) const {
    return of_scene;
  }
  HIPRT_HD HIPRT_INLINE BasicRay<Real> ray_into(const SceneView& scene, std::uint32_t instance,
                                                const BasicRay<Real>& of_scene) const {
    return ObjectPlace(scene).template ray_into<kMoves>(instance, of_scene);
  }
  HIPRT_HD HIPRT_INLINE InstancePath<1> path() const { return {depth(), {depth() == 0 ? 0 : instance_}}; }
  HIPRT_HD HIPRT_INLINE std::uint32_t depth() const { return instance_ == kInvalidId ? 0 : 1; }
  HIPRT_HD HIPRT_INLINE std::uint32_t instance(unsigned) const { return instance_; }
  HIPRT_HD HIPRT_INLINE bool without_filter(const SceneView& scene) const {
    return depth() != 0 && (scene.instances[instance_].flags & InstanceFlags::kNoFilter) != 0;
  }
  HIPRT_HD HIPRT_INLINE void enter(const SceneView& scene, std::uint32_t instance, const ObjectRecord& object,
                                   const BasicRay<Real>&) {
    instance_ = instance;
    base_ = scene.base + object.offset;
  }
  HIPRT_HD HIPRT_INLINE void leave(const SceneView& scene) { restart(scene); }
  HIPRT_HD HIPRT_INLINE KeptSlabs& slabs() const { return stack_detail::in_memory(ways_).outside[0]; }
  HIPRT_HD HIPRT_INLINE const ObjectRecord* object() const { return nullptr; }
  HIPRT_HD HIPRT_INLINE std::uint32_t object_number(const SceneView& scene) const {
    return depth() == 0 ? kInvalidId : scene.instances[instance_].object;
  }
  HIPRT_HD HIPRT_INLINE void restart(const SceneView& scene) {
    instance_ = kInvalidId;
    base_ = scene.base;
  }

 private:
  const std::byte* base_;
  LevelWays<1, Real>* ways_;
  std::uint32_t instance_ = kInvalidId;
};

/// Of policies without levels: nothing.
template <bool kMoves, class Real> class Levels<0, kMoves, Real> {
 public:
  template <class Storage> HIPRT_HD HIPRT_INLINE Levels(const SceneView&, const Storage&) {}
  HIPRT_HD HIPRT_INLINE const std::byte* base(const SceneView& scene) const { return scene.base; }
  HIPRT_HD HIPRT_INLINE const GeometryRecord& geometry(const SceneView& scene, std::uint32_t i) const {
    return scene.geometries[i];
  }
  HIPRT_HD HIPRT_INLINE const BasicRay<Real>& ray(const SceneView&, const BasicRay<Real>& of_scene) const {
    return of_scene;
  }
  HIPRT_HD HIPRT_INLINE InstancePath<0> path() const { return {}; }
  HIPRT_HD HIPRT_INLINE std::uint32_t object_number(const SceneView&) const { return kInvalidId; }
};

/// A way that a search remembers: of its hit, or of the one before.
/// @tparam kLevels more than 1: in memory of the stack's Storage.
template <unsigned kLevels> class SavedWay {
 public:
  /// @param place 1 or 2: which of the stack's ways.
  template <class Storage>
  HIPRT_HD HIPRT_INLINE SavedWay(const Storage& storage, unsigned place)
      : way_(storage.ways->instance + place * kLevels) {}

  template <bool kMoves, class Real> HIPRT_HD HIPRT_INLINE void save(const Levels<kLevels, kMoves, Real>& levels) {
    depth_ = levels.depth();
    for (unsigned i = 0; i < depth_; ++i) way_[i] = levels.instance(i);
  }
  HIPRT_HD HIPRT_INLINE void save(const SavedWay& other) {
    depth_ = other.depth_;
    for (unsigned i = 0; i < depth_; ++i) way_[i] = other.way_[i];
  }
  HIPRT_HD HIPRT_INLINE InstancePath<kLevels> path() const {
    InstancePath<kLevels> path;
    path.depth = depth_;
    for (unsigned i = 0; i < depth_; ++i) path.instance[i] = way_[i];
    return path;
  }
  /// As the paths compare: negative if this one comes first, 0 if they are the same.
  template <bool kMoves, class Real>
  HIPRT_HD HIPRT_INLINE int compare(const Levels<kLevels, kMoves, Real>& levels) const {
    const std::uint32_t depth = levels.depth();
    for (unsigned i = 0; i < depth_ && i < depth; ++i)
      if (way_[i] != levels.instance(i)) return way_[i] < levels.instance(i) ? -1 : 1;
    return depth_ < depth ? -1 : depth_ > depth ? 1 : 0;
  }

 private:
  std::uint32_t* way_;
  std::uint32_t depth_ = 0;
};
template <> class SavedWay<1> {
 public:
  template <class Storage> HIPRT_HD HIPRT_INLINE SavedWay(const Storage&, unsigned) {}
  template <bool kMoves, class Real> HIPRT_HD HIPRT_INLINE void save(const Levels<1, kMoves, Real>& levels) {
    instance_ = levels.instance(0);
  }
  HIPRT_HD HIPRT_INLINE void save(const SavedWay& other) { instance_ = other.instance_; }
  HIPRT_HD HIPRT_INLINE InstancePath<1> path() const {
    return instance_ == kInvalidId ? InstancePath<1>{} : InstancePath<1>{1, {instance_}};
  }
  template <bool kMoves, class Real> HIPRT_HD HIPRT_INLINE int compare(const Levels<1, kMoves, Real>& levels) const {
    const std::uint32_t other = levels.instance(0);
    return instance_ < other ? -1 : instance_ > other ? 1 : 0;
  }

 private:
  std::uint32_t instance_ = kInvalidId;
};
template <> class SavedWay<0> {
 public:
  template <class Storage> HIPRT_HD HIPRT_INLINE SavedWay(const Storage&, unsigned) {}
  template <bool kMoves, class Real> HIPRT_HD HIPRT_INLINE void save(const Levels<0, kMoves, Real>&) {}
  HIPRT_HD HIPRT_INLINE void save(const SavedWay&) {}
  HIPRT_HD HIPRT_INLINE InstancePath<0> path() const { return {}; }
};

/// Whether a ray sees a geometry of the file that it is in.
template <class P>
HIPRT_HD HIPRT_INLINE bool is_visible(const SceneView& scene,
                                      const Levels<P::kLevels, P::kMoves, typename P::Real>& levels,
                                      const BasicRay<typename P::Real>& ray, std::uint32_t geometry) {
  if constexpr ((P::kFeatures & feature_bit(Feature::kMasks)) != 0)
    return (scene.features & feature_bit(Feature::kMasks)) == 0 ||
           (levels.geometry(scene, geometry).mask & ray.mask) != 0;
  return true;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
