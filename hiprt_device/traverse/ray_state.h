#pragma once
/// The state of a traversal between two steps.
///
/// The state has the ray in the form that the tests need, and the instances that the ray is in. It has the next node,
/// the current leaf, and the nodes to visit later.

#include <hiprt_device/instances/levels.h>
#include <hiprt_device/instances/moving_box.h>
#include <hiprt_device/intersect/box_ray.h>
#include <hiprt_device/math/wave.h>
#include <hiprt_device/traverse/child_order.h>
#include <hiprt_device/traverse/policies.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Usual steps leave out what few rays need: boxes that are tested in software, and stack entries beyond shared memory.
/// A box test has them if its Choice has `rare`, 0 or all bits. Then it must also have intersect_usual(), for rays with
/// rare == 0.
template <class Boxes, class Backtrack>
concept HasUsualStep = requires(const Backtrack& backtrack, const typename Boxes::Choice& choice) {
  backtrack.is_usual(choice.rare);
};

/// @tparam P, Order, Test as those of Traversal.
template <PolicySet P, class Order, class Test> class RayState {
 public:
  using Real = typename P::Real;
  using Lanes = typename P::Lanes;
  using Layout = typename P::Layout;
  using Storage = typename P::Stack::Storage;
  using QueryRay = hiprt::QueryRay<P::kLevels, Real>;  ///< The ray of the query.

  /// @param root the scene's root; or kInvalidRef or kRefusedRef: then nothing is visited.
  /// @pre covers<P, Primitives>(scene) and is_traceable(ray), if root is the scene's
  HIPRT_HD HIPRT_FORCE_INLINE RayState(const SceneView& scene, const BasicRay<Real>& ray, NodeRef root,
                                       const Storage& storage)
      : levels_(scene, storage),
        boxes_(ray, scene.bounds, ray.tmax),
        slabs_(boxes_.ray(ray), margin(scene, ray), start(max_of(ray.tmin, Real(0)))),
        choice_(scene, boxes_.ray(ray).origin),
        // Outside instances the traversal tests only boxes, so any prepared ray will do.
        prepared_(kHasLevels && scene.instances != nullptr ? PreparedRay(BasicRay<Real>{}) : PreparedRay(ray)),
        tmin_(max_of(ray.tmin, Real(0))),
        backtrack_(storage, root),
        node_(root) {
    if constexpr (kKeepsBase) base_.first = scene.base;
    save_slabs(scene.instances != nullptr, margin(scene, ray));
  }

  /// Starts again at the root, for the part of the ray from @p tmin on.
  HIPRT_HD HIPRT_FORCE_INLINE void restart(const SceneView& scene, const BasicRay<Real>& ray, Real tmin,
                                           const Storage& storage) {
    tmin_ = tmin;
    if constexpr (kHasLevels) levels_.restart(scene);
    if constexpr (kHasLevels || kCountsFromStart) {
      boxes_ = box_ray(ray, scene.bounds, ray.tmax);
      prepare(ray, margin(scene, ray));
      save_slabs(scene.instances != nullptr, margin(scene, ray));
    }
    backtrack_ = Backtrack(storage, scene.root);
    node_ = scene.root;
    leaf_ = kInvalidRef;
    skip_ = 0;
  }

  /// Where a traversal has stopped at a hit. What else it needs is computed from the ray again.
  struct Position {
    hiprt::Levels<P::kLevels, P::kMoves, Real> levels;
    decltype(std::declval<BacktrackOf<typename P::Stack, typename Order::Entry>>().mark()) mark;
    NodeRef node, leaf;
    unsigned skip;
  };
  /// Continues there.
  /// @param ray that of the constructor, and the memory of its storage is as the stopped traversal has left it.
  HIPRT_HD HIPRT_FORCE_INLINE void resume(const SceneView& scene, const QueryRay& ray, Real limit,
                                          const Position& position) {
    levels_ = position.levels;
    backtrack_.continue_at(position.mark);
    node_ = position.node;
    leaf_ = position.leaf;
    skip_ = position.skip;
    if constexpr (kHasLevels)
      if (levels_.depth() != 0)
        begin_object(scene.objects[levels_.object_number(scene)], levels_.ray(scene, ray.get()), limit);
  }

  /// Whether the stack was too small, so that parts of the tree were not visited.
  /// @pre run() returned kFinished
  HIPRT_HD HIPRT_FORCE_INLINE bool overflowed() const { return leaf_ == kOverflowRef || node_ == kOverflowRef; }

  /// The ray as the triangle test uses it.
  HIPRT_HD HIPRT_FORCE_INLINE const auto& prepared_ray() const { return prepared_; }

  /// The instances that the ray is in.
  HIPRT_HD HIPRT_FORCE_INLINE const Levels<P::kLevels, P::kMoves, Real>& levels() const { return levels_; }

  /// Whether the root was kRefusedRef.
  HIPRT_HD HIPRT_FORCE_INLINE bool refused() const { return leaf_ == kRefusedRef || node_ == kRefusedRef; }

  /// Makes overflowed() true and leaves nothing to visit.
  HIPRT_HD HIPRT_FORCE_INLINE void overflow() {
    node_ = kInvalidRef;
    leaf_ = kOverflowRef;
  }
  /// Leaves nothing to visit.
  HIPRT_HD HIPRT_FORCE_INLINE void cancel() { node_ = leaf_ = kInvalidRef; }

 protected:
  using Backtrack = BacktrackOf<typename P::Stack, typename Order::Entry>;
  using PreparedRay = typename Test::template PreparedRay<Lanes>;
  static constexpr bool kTestSorts = SortingBoxTest<typename P::Boxes, Layout, Lanes>;
  static constexpr bool kHasLevels = P::kLevels != 0;
  /// The lanes that test boxes.
  using BoxLanes = std::conditional_t<kHasLevels || kTestSorts, Lanes, FlatLanes<Lanes>>;
  static_assert(!kTestSorts || std::is_same_v<Real, float>,
                "hiprt: double rays cannot be used with a box test that sorts");
  static constexpr bool kObserved = TraversalObserver<typename P::Counter>;
  static_assert(!kObserved || !kTestSorts, "hiprt: an observer cannot be used with a box test that sorts");
  static_assert(!kHasLevels || (!kTestSorts && !BacktrackingStack<typename P::Stack>),
                "hiprt: Instanced cannot be used with a restart trail or a box test that sorts");

  /// Whether distances to boxes are counted from tmin_. Rays in double are counted from a point of their own (BoxRay),
  /// which is not before tmin_ then.
  static constexpr bool kCountsFromStart = BoxLanes::kComparesBits && !kTestSorts;
  HIPRT_HD static HIPRT_FORCE_INLINE float start([[maybe_unused]] Real tmin) {
    if constexpr (kCountsFromStart && std::is_same_v<Real, float>)
      return tmin;
    else
      return 0.0f;
  }
  /// The form that tests boxes of a ray that begins at tmin_.
  HIPRT_HD HIPRT_FORCE_INLINE BoxRay<Real> box_ray(const BasicRay<Real>& ray, const Box& bounds, Real limit) const {
    if constexpr (!kCountsFromStart || std::is_same_v<Real, float>) return BoxRay<Real>(ray, bounds, limit);
    BasicRay<Real> rest = ray;
    rest.tmin = tmin_;
    return BoxRay<Real>(rest, bounds, limit);
  }
  /// The part of the ray that box tests are about, as distances.
  HIPRT_HD HIPRT_FORCE_INLINE float near_end() const { return kCountsFromStart ? 0.0f : boxes_.near_end(tmin_); }
  HIPRT_HD HIPRT_FORCE_INLINE float far_end(Real limit) const { return boxes_.far_end(limit) - start(tmin_); }

  /// Whether a register keeps where the file begins. With levels one does in any case.
  static constexpr bool kKeepsBase = !kHasLevels && P::kViewInMemory;

  static constexpr bool kHasUsualStep =
      kTestSorts && std::is_same_v<Order, AsTested> && HasUsualStep<typename P::Boxes, Backtrack>;
  /// Whether the next step is usual. On AMD: for every active lane.
  HIPRT_HD HIPRT_FORCE_INLINE bool is_usual() const { return !needed_by_a_lane(!backtrack_.is_usual(choice_.rare)); }

  /// First byte of the file that the ray is in.
  HIPRT_HD HIPRT_FORCE_INLINE const std::byte* base(const SceneView& scene) const {
    if constexpr (kKeepsBase)
      return base_.first;
    else
      return levels_.base(scene);
  }

  template <class Primitives> HIPRT_HD static constexpr bool has_custom() {
    return Primitives::kCount != 0 && (P::kFeatures & feature_bit(Feature::kCustom)) != 0;
  }

  /// Whether the current leaf is that of an instance.
  template <class Primitives> HIPRT_HD HIPRT_FORCE_INLINE bool is_at_instance(const SceneView& scene) const {
    if constexpr (!kHasLevels)
      return false;
    else if constexpr (!has_custom<Primitives>())
      return ref_type(leaf_) == NodeType::kProcedural;
    else
      return ref_type(leaf_) == NodeType::kProcedural && levels_.instances(scene) != nullptr;
  }

  /// Enters the object of the current leaf's instance, if there is one and the ray sees it.
  ///
  /// The leaf of an instance is alone in its run. It has one primitive: the instance, or a part of it.
  template <class Primitives>
  HIPRT_HD HIPRT_FORCE_INLINE void enter_instance(const SceneView& scene, const QueryRay& ray, Real limit,
                                                  typename P::Counter& counter) {
    if (is_end(leaf_) || !is_at_instance<Primitives>(scene)) return;
    const CustomLeaf leaf = load_record(*reinterpret_cast<const CustomLeaf*>(base(scene) + ref_offset(leaf_)));
    if constexpr (kObserved) counter.on_leaf_at(base(scene), leaf_);
    leaf_ = kInvalidRef;
    if (!meets_instance_box(scene, ray, leaf, limit)) return;
    const std::uint32_t instance = leaf.info.primitive[0];
    const InstanceRecord record = load_record(levels_.instances(scene)[instance]);
    if constexpr (requires { counter.on_instance(); }) counter.on_instance();
    if ((record.mask & ray.get().mask) == 0 || node_ == kOverflowRef) return;
    const BasicRay<Real> local = levels_.ray_into(scene, instance, levels_.ray_before(scene, ray.get()));
    const bool traceable = is_traceable(local);
    if (!traceable || !backtrack_.reserve()) {
      if (traceable) node_ = leaf_ = kOverflowRef;
      // Read back, so that no register keeps them while ray_into() needs many.
      slabs_ = slabs_outside(scene, ray);
      prepared_ = PreparedRay(BasicRay<Real>{});
      return;
    }
    go_below(entered_ref(leaf.info));
    const ObjectRecord& object = scene.objects[record.object];
    if constexpr (kObserved) counter.on_enter(instance);
    levels_.enter(scene, instance, object, local);
    begin_object(object, local, limit);
  }

  /// Leaves the instances that have no more nodes to visit.
  /// @pre node_ is kExitRef, and there is no current leaf. A leaf would be the instance's.
  HIPRT_HD HIPRT_FORCE_INLINE void leave_instances(const SceneView& scene, const QueryRay& ray, Real limit,
                                                   typename P::Counter& counter) {
    if constexpr (kHasLevels) {
      do {
        if constexpr (kObserved) counter.on_exit();
        levels_.leave(scene);
        if constexpr (!std::is_empty_v<BoxRay<Real>>) {
          const ObjectRecord* object = levels_.object();
          boxes_ = box_ray(levels_.ray(scene, ray.get()), object == nullptr ? scene.bounds : object->bounds, limit);
        }
        node_ = backtrack_.pop(far_end(limit));
      } while (node_ == kExitRef);
      // Outside there are only instances: no triangle is tested.
      if (!is_end(node_)) slabs_ = slabs_outside(scene, ray);
    }
  }

 private:
  /// Prepares the tests for an object that the ray has entered.
  /// @param local the ray as the object sees it.
  HIPRT_HD HIPRT_FORCE_INLINE void begin_object(const ObjectRecord& in_file, const BasicRay<Real>& local, Real limit) {
    const ObjectRecord object = load_record(in_file);
    boxes_ = box_ray(local, object.bounds, limit);
    // A group of instances has no triangles: only its boxes are tested.
    if (P::kLevels > 1 && object.instances != 0) {
      slabs_ = RaySlabs<BoxLanes>(boxes_.ray(local), margin(object, local), start(tmin_));
      save_slabs(true, margin(object, local));
      prepared_ = PreparedRay(BasicRay<Real>{});
    } else {
      prepare(local, margin(object, local));
    }
  }

  /// The slabs of the file of instances that the ray is in.
  HIPRT_HD HIPRT_FORCE_INLINE RaySlabs<BoxLanes> slabs_outside(const SceneView& scene, const QueryRay& ray) const {
    return RaySlabs<BoxLanes>(levels_.slabs(), boxes_.ray(levels_.ray(scene, ray.get())).origin, start(tmin_));
  }
  HIPRT_HD HIPRT_FORCE_INLINE float margin(const SceneView& scene, const BasicRay<Real>& ray) const {
    const Vec3& origin = boxes_.ray(ray).origin;
    if constexpr (kHasLevels)
      return boxes_.margin(P::Boxes::margin(origin, scene.bounds, scene.condition, scene.reach), scene.condition,
                           scene.reach);
    return boxes_.margin(P::Boxes::margin(origin, scene.bounds), 0.0f, 0.0f);
  }
  HIPRT_HD HIPRT_FORCE_INLINE void prepare(const BasicRay<Real>& ray, float margin) {
    slabs_ = RaySlabs<BoxLanes>(boxes_.ray(ray), margin, start(tmin_));
    prepared_ = PreparedRay(ray);
  }

  /// Saves the slabs that leave_instances() restores.
  HIPRT_HD HIPRT_FORCE_INLINE void save_slabs(bool has_instances, float margin) {
    if constexpr (kHasLevels)
      if (has_instances) slabs_.save(levels_.slabs(), margin);
  }

  HIPRT_HD HIPRT_FORCE_INLINE float margin(const ObjectRecord& object, const BasicRay<Real>& local) const {
    return boxes_.margin(P::Boxes::margin(boxes_.ray(local).origin, object.bounds, object.condition, object.reach),
                         object.condition, object.reach);
  }

  /// Whether the ray meets the leaf's own box.
  ///
  /// The box of the run is larger than the leaf's box in layouts that round and where boxes move. Otherwise the ray is
  /// known to meet the leaf's box.
  HIPRT_HD HIPRT_FORCE_INLINE bool meets_instance_box(const SceneView& scene, const QueryRay& ray,
                                                      const CustomLeaf& leaf, Real limit) const {
    constexpr bool kRounded = Layout::kId == NodeLayout::kHalf || Layout::kId == NodeLayout::kQuantized;
    if constexpr (P::kMoves || kRounded) {
      const bool moves = P::kMoves && (scene.features & feature_bit(Feature::kMovingBoxes)) != 0;
      if (moves || kRounded) {
        const Box box = moves ? box_at(leaf.box, shutter_fraction(scene, ray.get().time)) : leaf.box[0];
        return meets_box<BoxLanes>(box, slabs_, near_end(), far_end(limit));
      }
    }
    return true;
  }

  /// Pushes kExitRef if nodes outside are left to visit, and continues at @p root of an object.
  HIPRT_HD HIPRT_FORCE_INLINE void go_below(NodeRef root) {
    if (P::Schedule::kTogether && !is_end(node_)) backtrack_.later(entry_of(node_));
    if (kObserved || !backtrack_.empty()) backtrack_.later(entry_of(kExitRef));
    if constexpr (P::Schedule::kTogether)
      node_ = root;
    else
      backtrack_.later(entry_of(root));
  }

  /// The stack entry of a node that is visited whatever its distance.
  HIPRT_HD static HIPRT_FORCE_INLINE typename Order::Entry entry_of(NodeRef ref) {
    if constexpr (std::is_same_v<typename Order::Entry, NodeRef>)
      return ref;
    else
      return make_entry(0.0f, ref);
  }

 protected:
  struct Base {
    const std::byte* first;
  };
  struct NoBase {};
  /// What a box test that sorts decides once per ray.
  struct NoChoice {
    HIPRT_HD HIPRT_FORCE_INLINE NoChoice(const SceneView&, const Vec3&) {}
  };
  template <bool kSorts, class Boxes> struct ChoiceOf { using Type = NoChoice; };
  template <class Boxes> struct ChoiceOf<true, Boxes> { using Type = typename Boxes::Choice; };

  Levels<P::kLevels, P::kMoves, Real> levels_;
  [[no_unique_address]] std::conditional_t<kKeepsBase, Base, NoBase> base_;
  [[no_unique_address]] BoxRay<Real> boxes_;
  RaySlabs<BoxLanes> slabs_;
  [[no_unique_address]] typename ChoiceOf<kTestSorts, typename P::Boxes>::Type choice_;
  PreparedRay prepared_;
  Real tmin_;
  Backtrack backtrack_;
  NodeRef node_;                ///< The node to visit next; kInvalidRef at the end.
  NodeRef leaf_ = kInvalidRef;  ///< The leaf to test, or none. With Immediate schedules node_ is stale while there is
                                ///< one.
  unsigned skip_ = 0;           ///< Hits of this leaf that the visitor has seen: of triangles those in lower slots.
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
