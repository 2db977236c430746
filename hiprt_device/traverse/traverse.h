#pragma once
/// THE traversal loop: one text for every query, layout, test, stack and machine.

#include <hiprt_device/instances/levels.h>
#include <hiprt_device/instances/moving_box.h>
#include <hiprt_device/intersect/box_ray.h>
#include <hiprt_device/primitives/primitive_table.h>
#include <hiprt_device/traverse/child_order.h>
#include <hiprt_device/traverse/policies.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Where the ray's line meets a primitive of a leaf.
template <class Real> struct LeafHit {
  BasicCandidate<Real> at;
  const BasicCustomHit<Real>* custom;  ///< nullptr: a triangle.
  std::uint32_t geometry, primitive;
  NodeRef leaf;  ///< The record; for triangles its type, kTriangle0 or kTriangle1, tells which.
};

/// Why a traversal returned.
enum class Outcome {
  kFinished,  ///< Nothing is left to visit.
  kStopped,   ///< The visitor returned false; run() goes on behind that hit.
  kPaused,    ///< The wave leaves the loop for a while (WholeWave); run() goes on.
};

/// A ray's way through the tree, which can be left and taken up again.
/// @tparam P the policies.
/// @tparam Order P::ClosestOrder or P::AnyOrder.
/// @tparam kResumable whether run() may be called again after kStopped.
/// @tparam Test of triangles.
template <PolicySet P, class Order, bool kResumable, class Test = typename P::Triangle> class Traversal {
 public:
  using Real = typename P::Real;
  using Lanes = typename P::Lanes;
  using Layout = typename P::Layout;
  using Storage = typename P::Stack::Storage;
  using Kept = KeptRay<P::kLevels, Real>;  ///< Of the query.

  /// @param root the scene's, or kInvalidRef: nothing will be visited.
  /// @pre covers<P, Primitives>(scene) and is_traceable(ray), unless root is kInvalidRef
  HIPRT_HD HIPRT_INLINE Traversal(const SceneView& scene, const BasicRay<Real>& ray, NodeRef root,
                                  const Storage& storage)
      : levels_(scene, storage),
        boxes_(ray, scene.bounds, ray.tmax),
        slabs_(boxes_.ray(ray), margin(scene, ray)),
        // Of a scene of instances nothing but boxes is tested outside of them: any ray will do.
        prepared_(kHasLevels && scene.instances != nullptr ? PreparedRay(BasicRay<Real>{}) : PreparedRay(ray)),
        tmin_(max_of(ray.tmin, Real(0))),
        way_(storage, root),
        node_(root) {
    keep_slabs(scene.instances != nullptr, margin(scene, ray));
  }

  /// Starts again at the root, for the part of the ray from tmin on.
  HIPRT_HD HIPRT_INLINE void restart(const SceneView& scene, const BasicRay<Real>& ray, Real tmin,
                                     const Storage& storage) {
    tmin_ = tmin;
    if constexpr (kHasLevels) {
      levels_.restart(scene);
      boxes_ = BoxRay<Real>(ray, scene.bounds, ray.tmax);
      prepare(ray, margin(scene, ray));
      keep_slabs(scene.instances != nullptr, margin(scene, ray));
    }
    way_ = Way(storage, scene.root);
    node_ = scene.root;
    leaf_ = kInvalidRef;
    skip_ = 0;
  }

  /// Visits the leaves whose boxes the ray meets in [tmin, limit], in the order of Order.
  /// @param scene, ray those of the constructor.
  /// @param limit read before every test: the visitor may lower it.
  /// @param may_pause for WholeWave schedules.
  /// @param visit bool(const LeafHit&): false stops. (Under a WholeWave schedule it cannot go on then.)
  template <class Primitives, class Visit>
  HIPRT_HD HIPRT_INLINE Outcome run(const SceneView& scene, const Kept& ray, const Real& limit,
                                    const Primitives& primitives, typename P::Counter& counter, bool may_pause,
                                    Visit&& visit) {
    using Schedule = typename P::Schedule;
    [[maybe_unused]] const LaneMask group = Schedule::group();
    static_assert(kTestSorts ? SortedOrder<Order, typename P::Stack> : DistanceOrder<Order, typename P::Stack, Lanes>,
                  "hiprt: the order AsTested and a box test that sorts (of this layout) go together only");
    boxes_.set_limit(limit);
    Outcome outcome = Outcome::kFinished;
    NodeRef stopped_node = kInvalidRef, stopped_leaf = kInvalidRef;
    // Lanes enter instances together: behind the tests of triangles, which some have first; in batches before the
    // search, so that new rays need not wait for the others (on more levels that changes nothing: 0014).
    constexpr bool kEntersFirst = Schedule::kBatchOnly && P::kLevels == 1;
    for (;;) {
      if constexpr (Schedule::kTogether) {
        if (is_end(leaf_) && !is_box(node_)) take_leaf(scene, ray, limit, counter);
        if constexpr (kHasLevels && kEntersFirst) enter_instance<Primitives>(scene, ray, limit, counter);
        find_leaves_together(scene, ray, limit, counter, group);
      } else {
        if (is_end(leaf_)) find_leaf(scene, ray, limit, counter);
        if (is_end(leaf_)) return outcome;
      }
      while (!is_end(leaf_) && !is_at_instance<Primitives>(scene)) {
        if (!test_leaf(scene, ray, limit, primitives, counter, visit)) {
          outcome = Outcome::kStopped;
          if constexpr (!Schedule::kTogether) return outcome;
          stopped_node = node_;
          stopped_leaf = leaf_;
          cancel();
        }
        if (Schedule::kTogether && is_end(leaf_) && !is_box(node_)) take_leaf(scene, ray, limit, counter);
      }
      if constexpr (kHasLevels && !kEntersFirst) enter_instance<Primitives>(scene, ray, limit, counter);
      if constexpr (Schedule::kTogether) {
        const bool busy = !is_end(node_) || (kHasLevels && kEntersFirst && !is_end(leaf_));
        if (!Schedule::leaves(group, busy, may_pause)) continue;
        if (kResumable && outcome == Outcome::kStopped) {
          node_ = stopped_node;
          leaf_ = stopped_leaf;
        }
        return busy ? Outcome::kPaused : outcome;
      } else {
        if (kHasLevels && leaf_ == kOverflowRef) return outcome;
        node_ = way_.pop(boxes_.far_end(limit));
        if (kHasLevels && node_ == kExitRef) leave_instances(scene, ray, limit, counter);
      }
    }
  }

  /// Whether the stack was too small, so that parts of the tree were not visited. @pre run() returned kFinished
  HIPRT_HD HIPRT_INLINE bool overflowed() const { return leaf_ == kOverflowRef || node_ == kOverflowRef; }

  /// The ray as the test has it.
  HIPRT_HD HIPRT_INLINE const auto& prepared_ray() const { return prepared_; }

  /// The instances that the ray is in.
  HIPRT_HD HIPRT_INLINE const Levels<P::kLevels, P::kMoves, Real>& levels() const { return levels_; }

  /// Makes overflowed() true, and leaves nothing to visit.
  HIPRT_HD HIPRT_INLINE void overflow() {
    node_ = kInvalidRef;
    leaf_ = kOverflowRef;
  }
  /// Nothing is left to visit.
  HIPRT_HD HIPRT_INLINE void cancel() { node_ = leaf_ = kInvalidRef; }

 private:
  using Node = typename Layout::Node;
  using Leaf = typename Layout::Leaf;
  using Way = BacktrackOf<typename P::Stack, typename Order::Entry>;
  using PreparedRay = typename Test::template PreparedRay<Lanes>;
  static constexpr bool kTestSorts = SortingBoxTest<typename P::Boxes, Layout, Lanes>;
  static constexpr bool kHasLevels = P::kLevels != 0;
  static constexpr bool kObserved = TraversalObserver<typename P::Counter>;
  static_assert(!kObserved || !kTestSorts, "hiprt: an observer's tracer cannot have a box test that sorts");
  static_assert(!kHasLevels || (!kTestSorts && !BacktrackingStack<typename P::Stack>),
                "hiprt: Instanced: not with a restart trail or a box test that sorts");

  HIPRT_HD HIPRT_INLINE float margin(const SceneView& scene, const BasicRay<Real>& ray) const {
    const Vec3& origin = boxes_.ray(ray).origin;
    if constexpr (kHasLevels)
      return boxes_.margin(P::Boxes::margin(origin, scene.bounds, scene.condition, scene.reach), scene.condition,
                           scene.reach);
    return boxes_.margin(P::Boxes::margin(origin, scene.bounds), 0.0f, 0.0f);
  }
  HIPRT_HD HIPRT_INLINE void prepare(const BasicRay<Real>& ray, float margin) {
    slabs_ = RaySlabs<Lanes>(boxes_.ray(ray), margin);
    prepared_ = PreparedRay(ray);
  }

  /// For the way out of instances, where there are any.
  HIPRT_HD HIPRT_INLINE void keep_slabs(bool has_instances, float margin) {
    if constexpr (kHasLevels)
      if (has_instances) slabs_.keep(levels_.slabs(), margin);
  }

  /// Through box nodes to the next run of leaves, or the end.
  HIPRT_HD HIPRT_INLINE void find_leaf(const SceneView& scene, const Kept& ray, Real limit,
                                       typename P::Counter& counter) {
    while (is_box(node_)) {
      node_ = visit_boxes(scene, ray, limit, counter);
      if (kHasLevels && node_ == kExitRef) leave_instances(scene, ray, limit, counter);
    }
    leaf_ = node_;
  }

  /// The same, but beyond the first leaf as long as the schedule lets others of the group look for theirs.
  HIPRT_HD HIPRT_INLINE void find_leaves_together(const SceneView& scene, const Kept& ray, Real limit,
                                                  typename P::Counter& counter, LaneMask group) {
    // One step at least, whatever the schedule says of few searching lanes: others may have no leaf to test either.
    for (bool go_on = group_any(group, is_end(leaf_) && is_box(node_)); go_on;) {
      if (is_box(node_)) {
        node_ = visit_boxes(scene, ray, limit, counter);
        if (is_end(leaf_) && !is_box(node_)) take_leaf(scene, ray, limit, counter);
      }
      go_on = P::Schedule::search_on(group, is_end(leaf_) && is_box(node_));
    }
  }

  /// @pre !is_box(node_), and no leaf is at hand.
  HIPRT_HD HIPRT_INLINE void take_leaf(const SceneView& scene, const Kept& ray, Real limit,
                                       typename P::Counter& counter) {
    if constexpr (kHasLevels) {
      if (node_ == kExitRef) {
        leave_instances(scene, ray, limit, counter);
        if (is_box(node_)) return;
      }
    }
    leaf_ = node_;
    if (!is_end(leaf_)) node_ = way_.pop(boxes_.far_end(limit));
  }

  /// @return where to go on.
  HIPRT_HD HIPRT_INLINE NodeRef visit_boxes(const SceneView& scene, const Kept& ray, Real limit,
                                            typename P::Counter& counter) {
    counter.on_boxes();
    const float far_end = boxes_.far_end(limit);
    if constexpr (kTestSorts) {
      const SortedChildren met =
          P::Boxes::template intersect<Layout>(scene, node_, boxes_.ray(ray.get()), slabs_, far_end);
      return met.child[0] == kInvalidRef ? way_.pop(far_end) : Order::next(met, way_);
    } else {
      return visit_slabs(scene, far_end, counter);
    }
  }

  HIPRT_HD HIPRT_INLINE NodeRef visit_slabs(const SceneView& scene, float limit, typename P::Counter& counter) {
    const Node& node = *reinterpret_cast<const Node*>(levels_.base(scene) + ref_offset(node_));
    const BoxHits<Lanes> hits =
        intersect_boxes<Lanes>(node, slabs_, Lanes::uniform(boxes_.near_end(tmin_)), Lanes::uniform(limit));
    if constexpr (kObserved) {
      NodeVisit visit{levels_.base(scene), node_, {}, {}};
      for (unsigned i = 0; i < kBranching; ++i) {
        visit.met[i] = hits.hit(i);
        visit.enter[i] = boxes_.t_at(Lanes::get(hits.enter, i));
      }
      counter.on_node(visit);
    }
    if (!hits.any()) return way_.pop(limit);
    if constexpr (Lanes::kScalar)
      return Order::next(load_words(node.child).word, hits, way_);
    else
      return Order::next(node.child, hits, way_);
  }

  /// Whether the leaf at hand is an instance's.
  template <class Primitives> HIPRT_HD HIPRT_INLINE bool is_at_instance(const SceneView& scene) const {
    if constexpr (!kHasLevels)
      return false;
    else if constexpr (!has_custom<Primitives>())
      return ref_type(leaf_) == NodeType::kProcedural;
    else
      return ref_type(leaf_) == NodeType::kProcedural && levels_.instances(scene) != nullptr;
  }

  /// Tests the leaf at hand, no instance's, and steps to the next of its run. @return false if the visitor stopped.
  template <class Primitives, class Visit>
  HIPRT_HD HIPRT_INLINE bool test_leaf(const SceneView& scene, const Kept& ray, const Real& limit,
                                       const Primitives& primitives, typename P::Counter& counter, Visit&& visit) {
    const std::byte* record = levels_.base(scene) + ref_offset(leaf_);
    if constexpr (kObserved) counter.on_leaf_at(levels_.base(scene), leaf_);
    const LeafInfo info = load_info(record);
    unsigned met = 0;
    const auto offer = [&](const BasicCandidate<Real>& at, unsigned slot,
                           const BasicCustomHit<Real>* custom) HIPRT_INLINE_LAMBDA {
      if constexpr (kObserved) counter.on_candidate(slot, static_cast<float>(at.t));
      if constexpr (kResumable)
        if (met++ < skip_) return true;
      const std::uint32_t geometry = info.geometry_and_flags & kGeometryMask;
      const std::uint32_t primitive = choose(slot == 0, info.primitive[0], info.primitive[1]);
      if (visit(LeafHit<Real>{at, custom, geometry, primitive, leaf_ + (custom == nullptr ? slot : 0u)})) return true;
      if constexpr (kResumable) skip_ = met;
      return false;
    };
    bool go_on = true;
    if (has_custom<Primitives>() && ref_type(leaf_) == NodeType::kProcedural) {
      go_on = test_custom(scene, ray, limit, primitives, *reinterpret_cast<const CustomLeaf*>(record), info, offer);
    } else {
      counter.on_leaf(info.primitive[1] == kInvalidId ? 1u : 2u);
      go_on = Test::template intersect<Lanes>(*reinterpret_cast<const Leaf*>(record), info, prepared_,
                                              [&](const BasicCandidate<Real>& at, unsigned slot)
                                                  HIPRT_INLINE_LAMBDA { return offer(at, slot, nullptr); });
    }
    if (!go_on) return false;
    boxes_.set_limit(limit);
    skip_ = 0;
    leaf_ = (info.geometry_and_flags & kLastInRun) != 0 ? kInvalidRef : next_record(leaf_);
    return true;
  }

  /// The way out of instances, if node_ is one. Only once no leaf is at hand, which would be the instance's.
  HIPRT_HD HIPRT_INLINE void leave_instances(const SceneView& scene, const Kept& ray, Real limit,
                                             typename P::Counter& counter) {
    if constexpr (kHasLevels) {
      do {
        if constexpr (kObserved) counter.on_exit();
        levels_.leave(scene);
        if constexpr (!std::is_empty_v<BoxRay<Real>>) {
          const ObjectRecord* object = levels_.object();
          boxes_ =
              BoxRay<Real>(levels_.ray(scene, ray.get()), object == nullptr ? scene.bounds : object->bounds, limit);
        }
        node_ = way_.pop(boxes_.far_end(limit));
      } while (node_ == kExitRef);
      // Outside there are instances only: no triangle is tested.
      if (!is_end(node_)) slabs_ = RaySlabs<Lanes>(levels_.slabs(), boxes_.ray(levels_.ray(scene, ray.get())).origin);
    }
  }

  HIPRT_HD HIPRT_INLINE float margin(const ObjectRecord& object, const BasicRay<Real>& local) const {
    return boxes_.margin(P::Boxes::margin(boxes_.ray(local).origin, object.bounds, object.condition, object.reach),
                         object.condition, object.reach);
  }

  /// On with the object of the instance at hand, if there is one and the ray sees it. Its leaf has one primitive, the
  /// instance or a part of it, and is alone in its run.
  template <class Primitives>
  HIPRT_HD HIPRT_INLINE void enter_instance(const SceneView& scene, const Kept& ray, Real limit,
                                            typename P::Counter& counter) {
    if (is_end(leaf_) || !is_at_instance<Primitives>(scene)) return;
    const CustomLeaf leaf = load_record(*reinterpret_cast<const CustomLeaf*>(levels_.base(scene) + ref_offset(leaf_)));
    if constexpr (kObserved) counter.on_leaf_at(levels_.base(scene), leaf_);
    leaf_ = kInvalidRef;
    // Elsewhere the run's box is the leaf's, which the ray meets.
    constexpr bool kRounded = Layout::kId == NodeLayout::kHalf || Layout::kId == NodeLayout::kQuantized;
    if constexpr (P::kMoves || kRounded) {
      const bool moves = P::kMoves && (scene.features & feature_bit(Feature::kMovingBoxes)) != 0;
      if (moves || kRounded) {
        const Box box = moves ? box_at(leaf.box, place_in_shutter(scene, ray.get().time)) : leaf.box[0];
        if (!meets_box<Lanes>(box, slabs_, boxes_.near_end(tmin_), boxes_.far_end(limit))) return;
      }
    }
    const std::uint32_t instance = leaf.info.primitive[0];
    const InstanceRecord record = load_record(levels_.instances(scene)[instance]);
    if constexpr (requires { counter.on_instance(); }) counter.on_instance();
    if ((record.mask & ray.get().mask) == 0 || node_ == kOverflowRef) return;
    const BasicRay<Real> local = levels_.ray_into(scene, instance, levels_.ray_before(scene, ray.get()));
    if (!is_traceable(local)) return;
    if (!way_.make_room()) {
      node_ = leaf_ = kOverflowRef;
      return;
    }
    if (P::Schedule::kTogether && !is_end(node_)) way_.later(entry_of(node_));
    // Where nothing is left outside, nobody has to find the way out.
    if (kObserved || !way_.empty()) way_.later(entry_of(kExitRef));
    if constexpr (P::Schedule::kTogether)
      node_ = entered_ref(leaf.info);
    else
      way_.later(entry_of(entered_ref(leaf.info)));
    const ObjectRecord& in_file = scene.objects[record.object];
    const ObjectRecord object = load_record(in_file);
    if constexpr (kObserved) counter.on_enter(instance);
    levels_.enter(scene, instance, in_file, local);
    boxes_ = BoxRay<Real>(local, object.bounds, limit);
    // In a group of instances no triangle is tested.
    if (P::kLevels > 1 && object.instances != 0) {
      slabs_ = RaySlabs<Lanes>(boxes_.ray(local), margin(object, local));
      keep_slabs(true, margin(object, local));
    } else {
      prepare(local, margin(object, local));
    }
  }

  /// Of a node that is visited whatever its distance.
  HIPRT_HD static HIPRT_INLINE typename Order::Entry entry_of(NodeRef ref) {
    if constexpr (std::is_same_v<typename Order::Entry, NodeRef>)
      return ref;
    else
      return make_entry(0.0f, ref);
  }

  template <class Primitives> HIPRT_HD static constexpr bool has_custom() {
    return Primitives::kCount != 0 && (P::kFeatures & feature_bit(Feature::kCustom)) != 0;
  }
  HIPRT_HD static HIPRT_INLINE NodeRef next_record(NodeRef leaf) {
    static_assert(sizeof(Leaf) == kNodeGranularity && sizeof(CustomLeaf) == kNodeGranularity);
    return leaf + make_ref(kNodeGranularity, NodeType::kTriangle0);
  }

  template <class Primitives, class Offer>
  HIPRT_HD HIPRT_INLINE bool test_custom(const SceneView& scene, const Kept& ray, const Real& limit,
                                         const Primitives& primitives, const CustomLeaf& leaf, const LeafInfo& info,
                                         Offer&& offer) {
    const std::uint32_t geometry = info.geometry_and_flags & kGeometryMask;
    const unsigned type = custom_type(levels_.geometry(scene, geometry).flags);
    for (unsigned slot = 0; slot < 2; ++slot) {
      const std::uint32_t primitive = choose(slot == 0, info.primitive[0], info.primitive[1]);
      if (primitive == kInvalidId ||
          !meets_box<Lanes>(leaf.box[slot], slabs_, boxes_.near_end(tmin_), boxes_.far_end(limit)))
        continue;
      const auto report = [&](const BasicCustomHit<Real>& hit) HIPRT_INLINE_LAMBDA {
        return offer(BasicCandidate<Real>{hit.t, hit.u, hit.v}, slot, &hit);
      };
      if (!primitives.intersect(type, levels_.ray(scene, ray.get()), max_of(ray.get().tmin, Real(0)), limit,
                                PrimitiveId{geometry, primitive, levels_.object_number(scene)}, report))
        return false;
    }
    return true;
  }

  Levels<P::kLevels, P::kMoves, Real> levels_;
  [[no_unique_address]] BoxRay<Real> boxes_;
  RaySlabs<Lanes> slabs_;
  PreparedRay prepared_;
  Real tmin_;
  Way way_;
  NodeRef node_;                ///< To visit next; kInvalidRef at the end.
  NodeRef leaf_ = kInvalidRef;  ///< Record to test, or none. Without postponing: then node_ is stale.
  unsigned skip_ = 0;           ///< Hits of the record that the visitor has seen before it stopped.
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
