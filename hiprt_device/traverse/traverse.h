#pragma once
/// The traversal loop: one function for every query, layout, test, stack and machine.

#include <hiprt_device/primitives/primitive_table.h>
#include <hiprt_device/traverse/ray_state.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// A point where the ray's line meets a primitive of a leaf.
template <class Real> struct LeafHit {
  BasicCandidate<Real> at;
  const BasicCustomHit<Real>* custom;  ///< nullptr: a triangle.
  std::uint32_t geometry, primitive;
  NodeRef leaf;  ///< The leaf's record. For triangles its type, kTriangle0 or kTriangle1, names the triangle.
};

/// Why a traversal returned.
enum class Outcome {
  kFinished,  ///< Nothing is left to visit.
  kStopped,   ///< The visitor returned false; run() continues behind that hit.
  kPaused,    ///< The wave leaves the loop to fetch rays (WholeWave); run() continues.
};

/// No record of where a traversal stops: the traversal itself can continue there, if it is resumable.
struct NoStop {};

/// The traversal of a tree by one ray. It can stop at a hit and continue.
/// @tparam P the policies.
/// @tparam Order P::ClosestOrder or P::AnyOrder.
/// @tparam kResumable whether run() may be called again after kStopped.
/// @tparam Test of triangles.
template <PolicySet P, class Order, bool kResumable, class Test = typename P::Triangle>
class Traversal : public RayState<P, Order, Test> {
  using State = RayState<P, Order, Test>;
  using State::kHasLevels, State::kHasUsualStep, State::kObserved, State::kTestSorts;
  using State::levels_, State::boxes_, State::slabs_, State::prepared_, State::tmin_, State::backtrack_, State::node_,
      State::leaf_, State::skip_, State::choice_;
  using typename State::BoxLanes;

 public:
  using State::cancel, State::State;
  using typename State::Position;
  using typename State::QueryRay, typename State::Lanes, typename State::Layout, typename State::Real;

  /// Visits the leaves whose boxes the ray meets in [tmin, limit], in the order of Order.
  /// @param scene, ray those of the constructor.
  /// @param limit read before every test: the visitor may lower it.
  /// @param may_pause whether a WholeWave schedule may return kPaused.
  /// @param visit bool(const LeafHit&): false stops. Under a WholeWave schedule the search cannot continue after that.
  /// @param stop NoStop, or a Position*: gets where the visitor has stopped. Then only resume() continues there, so
  ///        that no register keeps it while the other lanes search.
  template <class Primitives, class Visit, class Stop = NoStop>
  HIPRT_HD HIPRT_FORCE_INLINE Outcome run(const SceneView& scene, const QueryRay& ray, const Real& limit,
                                          const Primitives& primitives, typename P::Counter& counter,
                                          [[maybe_unused]] bool may_pause, Visit&& visit, Stop stop = {}) {
    static_assert(
        kTestSorts ? SortedOrder<Order, typename P::Stack> : DistanceOrder<Order, typename P::Stack, Lanes>,
        "hiprt: the order AsTested needs a box test that sorts (for this layout), and such a test needs AsTested");
    if constexpr (P::Schedule::kTogether)
      return run_together(scene, ray, limit, primitives, counter, may_pause, visit, stop);
    else
      return run_alone(scene, ray, limit, primitives, counter, visit, stop);
  }

 private:
  /// Visits of a lane between two votes of its group. With instances the loop's code would be too large. With up to
  /// eight levels more visits give 0.74 to 0.96 of the speed. With one level two give 1.00 to 1.05 (H200).
  static constexpr unsigned kMostVisits = P::kLevels == 0 ? ~0u : P::kLevels == 1 ? 2u : 1u;
  static constexpr unsigned kVisits =
      kMostVisits < kVisitsOf<typename P::Schedule> ? kMostVisits : kVisitsOf<typename P::Schedule>;
  template <class Stop> static constexpr bool kKeepsStop = !std::is_same_v<Stop, NoStop>;
  /// Whether the order, not the box test, compares distances with the limit.
  static constexpr bool kOrderComparesLimit =
      BoxLanes::kComparesBits && !kObserved && !State::Backtrack::kNeedsStableOrder && kComparesLimitOf<Order>;
  using Node = typename Layout::Node;
  using Leaf = typename Layout::Leaf;

  /// Traces one ray by itself: it finds a leaf, tests it, and pops the next node.
  template <class Primitives, class Visit, class Stop>
  HIPRT_HD HIPRT_FORCE_INLINE Outcome run_alone(const SceneView& scene, const QueryRay& ray, const Real& limit,
                                                const Primitives& primitives, typename P::Counter& counter,
                                                Visit&& visit, [[maybe_unused]] Stop stop) {
    boxes_.set_limit(limit);
    for (;;) {
      if (is_end(leaf_)) find_leaf(scene, ray, limit, counter);
      if (is_end(leaf_)) return Outcome::kFinished;
      while (!is_end(leaf_) && !this->template is_at_instance<Primitives>(scene))
        if (!test_leaf(scene, ray, limit, primitives, counter, visit, skip_)) {
          if constexpr (kKeepsStop<Stop>) *stop = {levels_, backtrack_.mark(), node_, leaf_, skip_};
          return Outcome::kStopped;
        }
      if constexpr (kHasLevels) {
        this->template enter_instance<Primitives>(scene, ray, limit, counter);
        if (leaf_ == kOverflowRef) return Outcome::kFinished;
      }
      node_ = backtrack_.pop(this->far_end(limit));
      if constexpr (kHasLevels)
        if (node_ == kExitRef) this->leave_instances(scene, ray, limit, counter);
    }
  }

  /// Traces the rays of a group of lanes together. All lanes search leaves until the schedule ends the search. Then
  /// all lanes test their leaves, and then all enter their instances.
  ///
  /// In one-level batches lanes enter instances before the search, so that newly fetched rays do not idle. With more
  /// levels this makes no difference (docs/decisions/0014-instances.md).
  template <class Primitives, class Visit, class Stop>
  HIPRT_HD HIPRT_FORCE_INLINE Outcome run_together(const SceneView& scene, const QueryRay& ray, const Real& limit,
                                                   const Primitives& primitives, typename P::Counter& counter,
                                                   bool may_pause, Visit&& visit, [[maybe_unused]] Stop stop) {
    using Schedule = typename P::Schedule;
    constexpr bool kEntersFirst = Schedule::kBatchOnly && P::kLevels == 1;
    const LaneMask group = Schedule::group();
    boxes_.set_limit(limit);
    Outcome outcome = Outcome::kFinished;
    // Where a lane has stopped. It waits for the others with nothing to visit.
    constexpr bool kContinues = kResumable && !kKeepsStop<Stop>;
    NodeRef stopped_node = kInvalidRef, stopped_leaf = kInvalidRef;
    unsigned stopped_skip = 0;
    for (;;) {
      if (is_end(leaf_) && !is_box(node_)) take_leaf(scene, ray, limit, counter);
      if constexpr (kHasLevels && kEntersFirst) this->template enter_instance<Primitives>(scene, ray, limit, counter);
      find_leaves_together(scene, ray, limit, counter, group);
      while (!is_end(leaf_) && !this->template is_at_instance<Primitives>(scene)) {
        if (!test_leaf(scene, ray, limit, primitives, counter, visit, stopped_skip)) {
          outcome = Outcome::kStopped;
          if constexpr (kKeepsStop<Stop>) *stop = {levels_, backtrack_.mark(), node_, leaf_, stopped_skip};
          stopped_node = node_;
          stopped_leaf = leaf_;
          cancel();
        }
        if (is_end(leaf_) && !is_box(node_)) take_leaf(scene, ray, limit, counter);
      }
      if constexpr (kHasLevels && !kEntersFirst) this->template enter_instance<Primitives>(scene, ray, limit, counter);
      const bool busy = !is_end(node_) || (kHasLevels && kEntersFirst && !is_end(leaf_));
      if (!Schedule::leaves(group, busy, may_pause)) continue;
      if (kContinues && outcome == Outcome::kStopped) {
        node_ = stopped_node;
        leaf_ = stopped_leaf;
        skip_ = stopped_skip;
      }
      return busy ? Outcome::kPaused : outcome;
    }
  }

  /// Visits box nodes until it comes to a run of leaves, or to the end.
  HIPRT_HD HIPRT_FORCE_INLINE void find_leaf(const SceneView& scene, const QueryRay& ray, Real limit,
                                             typename P::Counter& counter) {
    while (is_box(node_)) {
      if constexpr (kHasUsualStep) {
        if (this->is_usual()) [[likely]] {
          // One loop for both steps would copy registers. A lane that needs visit_any() waits until the others have
          // found their leaves.
          for (bool go_on = true; go_on;) {
            node_ = visit_usual(scene, ray, limit, counter);
            const bool usual = backtrack_.is_usual(choice_.rare);
            go_on = is_box(node_) & usual;
          }
          continue;
        }
      }
      node_ = visit_any(scene, ray, limit, counter);
      if (kHasLevels && node_ == kExitRef) this->leave_instances(scene, ray, limit, counter);
    }
    leaf_ = node_;
  }

  /// find_leaf() for a group. A lane that has a leaf continues to search while the schedule lets the other lanes
  /// search.
  HIPRT_HD HIPRT_FORCE_INLINE void find_leaves_together(const SceneView& scene, const QueryRay& ray, Real limit,
                                                        typename P::Counter& counter, LaneMask group) {
    // At least one step, even if few lanes search: the other lanes may have no leaf to test either.
    for (bool go_on = group_any(group, is_end(leaf_) && is_box(node_)); go_on;) {
      search_steps<kVisits>(scene, ray, limit, counter);
      go_on = P::Schedule::search_on(group, is_end(leaf_) && is_box(node_));
    }
  }

  /// Visits a box node if that is next, and then takes a leaf if the ray has none.
  /// @tparam kCount how often. Not a loop, because compilers may keep loops.
  template <unsigned kCount>
  HIPRT_HD HIPRT_FORCE_INLINE void search_steps(const SceneView& scene, const QueryRay& ray, Real limit,
                                                typename P::Counter& counter) {
    static_assert(kCount >= 1, "hiprt: kVisits of a schedule must be at least 1");
    if (is_box(node_)) {
      node_ = visit_boxes(scene, ray, limit, counter);
      if (is_end(leaf_) && !is_box(node_)) take_leaf(scene, ray, limit, counter);
    }
    if constexpr (kCount > 1) search_steps<kCount - 1>(scene, ray, limit, counter);
  }

  /// Makes node_ the current leaf and pops the next node.
  /// @pre !is_box(node_), and there is no current leaf.
  HIPRT_HD HIPRT_FORCE_INLINE void take_leaf(const SceneView& scene, const QueryRay& ray, Real limit,
                                             typename P::Counter& counter) {
    if constexpr (kHasLevels) {
      if (node_ == kExitRef) {
        this->leave_instances(scene, ray, limit, counter);
        if (is_box(node_)) return;
      }
    }
    leaf_ = node_;
    if (!is_end(leaf_)) node_ = backtrack_.pop(this->far_end(limit));
  }

  /// Tests the boxes of node_. @return the node to visit next.
  HIPRT_HD HIPRT_FORCE_INLINE NodeRef visit_boxes(const SceneView& scene, const QueryRay& ray, Real limit,
                                                  typename P::Counter& counter) {
    if constexpr (kHasUsualStep)
      if (this->is_usual()) [[likely]]
        return visit_usual(scene, ray, limit, counter);
    return visit_any(scene, ray, limit, counter);
  }

  /// visit_boxes() by a usual step (HasUsualStep). @pre every active lane's step is usual
  HIPRT_HD HIPRT_FORCE_INLINE NodeRef visit_usual(const SceneView& scene, const QueryRay& ray, Real limit,
                                                  typename P::Counter& counter) {
    counter.on_boxes();
    const NodeRef top = backtrack_.top();
    const SortedChildren met = P::Boxes::template intersect_usual<Layout>(scene, node_, boxes_.ray(ray.get()), slabs_,
                                                                          choice_, this->far_end(limit));
    return backtrack_.next_usual(met.child, top);
  }

  /// visit_boxes() by a step that suits every ray.
  HIPRT_HD HIPRT_FORCE_INLINE NodeRef visit_any(const SceneView& scene, const QueryRay& ray, Real limit,
                                                typename P::Counter& counter) {
    counter.on_boxes();
    const float far_end = this->far_end(limit);
    if constexpr (kTestSorts) {
      const SortedChildren met =
          P::Boxes::template intersect<Layout>(scene, node_, boxes_.ray(ray.get()), slabs_, choice_, far_end);
      return Order::next(met, backtrack_, far_end);
    } else {
      return visit_slabs(scene, far_end, counter);
    }
  }

  HIPRT_HD HIPRT_FORCE_INLINE NodeRef visit_slabs(const SceneView& scene, float limit, typename P::Counter& counter) {
    const Node& node = *reinterpret_cast<const Node*>(this->base(scene) + ref_offset(node_));
    if constexpr (kOrderComparesLimit)
      return Order::next_within(node, intersect_boxes<BoxLanes>(node, slabs_), limit, backtrack_);
    const BoxHits<BoxLanes> hits =
        intersect_boxes<BoxLanes>(node, slabs_, BoxLanes::uniform(this->near_end()), BoxLanes::uniform(limit));
    if constexpr (kObserved) {
      NodeVisit visit{this->base(scene), node_, {}, {}};
      for (unsigned i = 0; i < kBranching; ++i) {
        visit.met[i] = hits.hit(i);
        visit.enter[i] = boxes_.t_at(BoxLanes::get(hits.enter, i) + State::start(tmin_));
      }
      counter.on_node(visit);
    }
    if (!hits.any()) return backtrack_.pop(limit);
    if constexpr (Lanes::kScalar)
      return Order::next(load_words(node.child).word, hits, backtrack_);
    else
      return Order::next(node.child, hits, backtrack_);
  }

  /// Tests the current leaf and steps to the next leaf of its run.
  /// @pre the leaf is not an instance's.
  /// @param skip becomes skip_ for the next call, if the visitor stopped.
  /// @return false if the visitor stopped.
  template <class Primitives, class Visit>
  HIPRT_HD HIPRT_FORCE_INLINE bool test_leaf(const SceneView& scene, const QueryRay& ray, const Real& limit,
                                             const Primitives& primitives, typename P::Counter& counter, Visit&& visit,
                                             [[maybe_unused]] unsigned& skip) {
    const std::byte* record = this->base(scene) + ref_offset(leaf_);
    if constexpr (kObserved) counter.on_leaf_at(this->base(scene), leaf_);
    const LeafInfo info = load_info(record);
    [[maybe_unused]] unsigned reported = 0;
    const auto offer = [&](const BasicCandidate<Real>& at, unsigned slot,
                           const BasicCustomHit<Real>* custom) HIPRT_FORCE_INLINE_LAMBDA {
      if constexpr (kObserved) counter.on_candidate(slot, static_cast<float>(at.t));
      // A triangle is met once. So is a primitive whose functor may be called once: test_custom() does not call it
      // again. Others may report several hits.
      const bool by_slot = kCountsAnyT<Primitives> || custom == nullptr;
      if constexpr (kResumable)
        if ((custom == nullptr ? slot : by_slot ? skip_ : reported++) < skip_) return true;
      const std::uint32_t geometry = info.geometry_and_flags & kGeometryMask;
      const std::uint32_t primitive = choose(slot == 0, info.primitive[0], info.primitive[1]);
      if (visit(LeafHit<Real>{at, custom, geometry, primitive, leaf_ + (custom == nullptr ? slot : 0u)})) return true;
      if constexpr (kResumable) skip = by_slot ? slot + 1 : reported;
      return false;
    };
    bool go_on = true;
    if (State::template has_custom<Primitives>() && ref_type(leaf_) == NodeType::kProcedural) {
      go_on = test_custom(scene, ray, limit, primitives, *reinterpret_cast<const CustomLeaf*>(record), info, offer);
    } else {
      counter.on_leaf(info.primitive[1] == kInvalidId ? 1u : 2u);
      go_on = Test::template intersect<Lanes>(*reinterpret_cast<const Leaf*>(record), info, prepared_,
                                              [&](const BasicCandidate<Real>& at, unsigned slot)
                                                  HIPRT_FORCE_INLINE_LAMBDA { return offer(at, slot, nullptr); });
    }
    if (!go_on) return false;
    boxes_.set_limit(limit);
    skip_ = 0;
    leaf_ = (info.geometry_and_flags & kLastInRun) != 0 ? kInvalidRef : next_record(leaf_);
    return true;
  }

  template <class Primitives, class Offer>
  HIPRT_HD HIPRT_FORCE_INLINE bool test_custom(const SceneView& scene, const QueryRay& ray, const Real& limit,
                                               const Primitives& primitives, const CustomLeaf& leaf,
                                               const LeafInfo& info, Offer&& offer) {
    const std::uint32_t geometry = info.geometry_and_flags & kGeometryMask;
    const unsigned type = geometry_type(levels_.geometry(scene, geometry).flags);
    for (unsigned slot = 0; slot < 2; ++slot) {
      const std::uint32_t primitive = choose(slot == 0, info.primitive[0], info.primitive[1]);
      if (kResumable && kCountsAnyT<Primitives> && slot < skip_) continue;
      if (primitive == kInvalidId ||
          !meets_box<BoxLanes>(leaf.box[slot], slabs_, this->near_end(), this->far_end(limit)))
        continue;
      const auto report = [&](const BasicCustomHit<Real>& hit) HIPRT_FORCE_INLINE_LAMBDA {
        return offer(BasicCandidate<Real>{hit.t, hit.u, hit.v}, slot, &hit);
      };
      if (!primitives.intersect(
              type, levels_.ray(scene, ray.get()), max_of(ray.get().tmin, Real(0)), limit,
              PathPrimitiveId<decltype(levels_)>({geometry, primitive, levels_.object_number(scene)}, scene, levels_),
              report))
        return false;
    }
    return true;
  }

  HIPRT_HD static HIPRT_FORCE_INLINE NodeRef next_record(NodeRef leaf) {
    static_assert(sizeof(Leaf) == kNodeGranularity && sizeof(CustomLeaf) == kNodeGranularity);
    return leaf + make_ref(kNodeGranularity, NodeType::kTriangle0);
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
