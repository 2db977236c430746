#pragma once
/// The common part of closest, any and all hits: a traversal, a filter, and the current hit.
///
/// Internal. closest_hit.h, any_hit.h and all_hits.h have the queries.

#include <hiprt_device/instances/instance_surface.h>
#include <hiprt_device/instances/saved_path.h>
#include <hiprt_device/query/deferred_hits.h>
#include <hiprt_device/traverse/traverse.h>

namespace hiprt {

/// The state of a query.
enum class TraversalState {
  kInit,           ///< There was no next_hit() yet.
  kHit,            ///< The last next_hit() found a hit; the next one continues behind it.
  kFinished,       ///< There are no more hits.
  kStackOverflow,  ///< The stack was too small: parts of the tree were not visited, and hits may be missing.
  kRefused,  ///< The policies do not cover the scene (covers()). Or the scene has custom primitives, and the query has
             ///< none, or its set's covers(scene) is false.
};

inline namespace HIPRT_ISA_NAMESPACE {

/// The FilterQuestions of a search.
template <class Search>
class FilterAnswers
    : public PathReader<
          Levels<Search::PolicyType::kLevels, Search::PolicyType::kMoves, typename Search::PolicyType::Real>> {
  using P = typename Search::PolicyType;
  using Real = typename P::Real;
  using Reader = PathReader<Levels<P::kLevels, P::kMoves, Real>>;

 public:
  HIPRT_HD HIPRT_FORCE_INLINE FilterAnswers(const Search& search, const LeafHit<Real>& found,
                                            const typename Search::Result& candidate)
      : Reader(*search.scene_, search.traversal_.levels()), search_(&search), found_(&found), candidate_(&candidate) {}

  HIPRT_HD HIPRT_FORCE_INLINE bool is_front() const {
    if (found_->custom == nullptr) return found_->at.front;
    const BasicVec3<Real>& n = found_->custom->normal;
    const BasicVec3<Real> d = this->levels_->ray(*this->scene_, search_->ray_.get()).direction;
    return !(n.x * d.x + n.y * d.y + n.z * d.z > Real(0));
  }
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t type() const {
    return geometry_type(this->levels_->geometry(*this->scene_, found_->geometry).flags);
  }
  HIPRT_HD HIPRT_FORCE_INLINE BasicVec3<Real> normal() const {
    typename Search::Result hit = *candidate_;
    search_->complete_surface(hit, found_->custom == nullptr ? found_->leaf : kInvalidRef);
    return hit.normal;
  }
  HIPRT_HD HIPRT_FORCE_INLINE BasicRay<Real> object_ray() const {
    BasicRay<Real> ray = this->levels_->ray(*this->scene_, search_->ray_.get());
    ray.tmax = search_->limit_;
    return ray;
  }
  // The following are for hiprt_device/compat.
  /// The leaf's record and the triangle's number in it. Triangles only.
  HIPRT_HD HIPRT_FORCE_INLINE const std::byte* leaf() const {
    return this->levels_->base(*this->scene_) + ref_offset(found_->leaf);
  }
  HIPRT_HD HIPRT_FORCE_INLINE unsigned leaf_triangle() const { return found_->leaf & 1u; }

 private:
  const Search* search_;
  const LeafHit<Real>* found_;
  const typename Search::Result* candidate_;
};

/// What a HitSearch finds.
enum class SearchKind {
  kClosest,  ///< find_closest()
  kOne,      ///< find_any(), once.
  kEach,     ///< find_any(), which continues behind a hit. That takes registers.
};

/// A search for the hits of one ray.
/// @tparam Order P::ClosestOrder or P::AnyOrder.
template <PolicySet P, class Order, SearchKind kKind, IntersectionFilter<typename P::Real> Filter,
          PrimitiveSet<typename P::Real> Primitives>
class HitSearch {
  static constexpr bool kResumable = kKind == SearchKind::kEach;

 public:
  using Storage = typename P::Stack::Storage;
  using Counter = typename P::Counter;
  using Real = typename P::Real;
  using PolicyType = P;
  using OrderType = Order;
  using Result = HitOf<Real, P::kLevels>;

  HIPRT_HD HIPRT_FORCE_INLINE HitSearch(const SceneView& scene, const BasicRay<Real>& ray, const Storage& storage,
                                        const Filter& filter, const Primitives& primitives, const Counter& counter)
      : scene_(&scene),
        ray_(ray, storage),
        storage_(storage),
        filter_(filter),
        primitives_(primitives),
        counter_(counter),
        traversal_(scene, ray, root_of(ray), storage),
        hit_path_(storage, 1),
        after_path_(storage, 2),
        after_t_(least_t(ray, primitives)),
        limit_(finite(ray.tmax)) {
    if constexpr (kDefers) deferred_.low = limit_;
    if (!is_covered()) state_ = TraversalState::kRefused;
  }

  HIPRT_HD HIPRT_FORCE_INLINE TraversalState state() const { return state_; }
  HIPRT_HD HIPRT_FORCE_INLINE const Counter& counter() const { return counter_; }
  /// The current hit, without what complete_hit() adds to a triangle's.
  HIPRT_HD HIPRT_FORCE_INLINE Result hit() const {
    Result hit;
    static_cast<BasicHit<Real>&>(hit) = hit_;
    if constexpr (P::kLevels != 0)
      if (hit_.found()) hit.path = hit_path_.path();
    return hit;
  }

  /// The leaf with the triangle of the current hit; kInvalidRef: a custom primitive.
  HIPRT_HD HIPRT_FORCE_INLINE NodeRef leaf() const { return leaf_; }
  /// Where find_any() has stopped at a hit.
  using Position = typename Traversal<P, Order, kResumable, SearchTest<false, typename P::Triangle>>::Position;
  /// Continues there: for a search that has been made again, as the first was made.
  HIPRT_HD HIPRT_FORCE_INLINE void resume(const Position& position) {
    traversal_.resume(*scene_, ray_, limit_, position);
  }

  /// Whether a search can find more. If not, hit() is a miss, or says that the search failed.
  HIPRT_HD HIPRT_FORCE_INLINE bool can_go_on() {
    if (state_ == TraversalState::kHit && stopped_) state_ = TraversalState::kFinished;
    if (state_ == TraversalState::kInit || state_ == TraversalState::kHit) return true;
    forget_hit();
    if (state_ != TraversalState::kFinished) hit_.t = std::numeric_limits<Real>::quiet_NaN();
    return false;
  }

  /// Prepares the search of the closest hit behind the current one, in the order of t, geometry, primitive.
  HIPRT_HD HIPRT_FORCE_INLINE void start_behind_hit() {
    after_t_ = max_of(hit_.t, Real(0));  // Not -0: its bits would come last in the order of entry distances.
    after_geometry_ = hit_.geometry;
    after_primitive_ = hit_.primitive;
    after_path_.save(hit_path_);
    limit_ = finite(ray_.get().tmax);
    if constexpr (kDefers) deferred_.low = limit_;
    forget_hit();
    traversal_.restart(*scene_, ray_.get(), after_t_, storage_);
  }

  /// Searches the closest hit behind the last.
  /// @return false: the wave pauses; call again.
  HIPRT_HD HIPRT_FORCE_INLINE bool find_closest(bool may_pause) {
    static_assert(!BacktrackingStack<typename P::Stack> || !std::same_as<Order, Unordered>,
                  "hiprt: Unordered: a restart trail finds closest hits only in the order of distance");
    if constexpr (kDefers) {
      DeferredDecisions<HitSearch> decisions(*this);
      if (decisions.search(may_pause) == Outcome::kPaused) return false;
      if (deferred_.open.is_crowded()) return decisions.search_again();
      decisions.decide_hits();
    } else {
      const Outcome outcome = traversal_.run(
          *scene_, ray_, limit_, primitives_, counter_, may_pause,
          [&](const LeafHit<Real>& found) HIPRT_FORCE_INLINE_LAMBDA {
            if (!counts_at_any_t(found) && (!(found.at.t >= after_t_ && found.at.t <= limit_) || loses_tie(found)))
              return true;
            if (!accept(found)) return true;
            limit_ = found.at.t;
            return !stopped_;
          });
      if (outcome == Outcome::kPaused) return false;
    }
    // Limit and t share a register until here.
    hit_.t = limit_;
    // A node that was not visited may have a nearer hit.
    conclude(hit_.found() && (stopped_ || !traversal_.overflowed()));
    return true;
  }

  /// Searches one more hit, whichever comes first.
  /// @param stop NoStop, or a Position*: gets where the search stops. Then only resume() continues it.
  /// @return as find_closest().
  template <class Stop = NoStop> HIPRT_HD HIPRT_FORCE_INLINE bool find_any(bool may_pause, Stop stop = {}) {
    static_assert(kKind != SearchKind::kClosest);
    const Outcome outcome = traversal_.run(
        *scene_, ray_, limit_, primitives_, counter_, may_pause,
        [&](const LeafHit<Real>& found) HIPRT_FORCE_INLINE_LAMBDA {
          if (!counts_at_any_t(found) && !(found.at.t >= after_t_ && found.at.t <= limit_)) return true;
          return !accept(found);
        },
        stop);
    if (outcome == Outcome::kPaused) return false;
    // The only hit of this search is the one that stopped it.
    conclude(kForgetsOutcome ? hit_.found() : outcome == Outcome::kStopped);
    return true;
  }

  /// Leaves nothing to visit, and nothing to count.
  HIPRT_HD HIPRT_FORCE_INLINE void cancel() { traversal_.cancel(); }

  HIPRT_HD HIPRT_FORCE_INLINE void forget_hit() {
    hit_ = BasicHit<Real>{};
    leaf_ = kInvalidRef;
  }

  /// The current hit with normal and error bound, if P::kSurface. A custom primitive has reported its own.
  HIPRT_HD HIPRT_FORCE_INLINE Result complete_hit() const {
    Result hit = this->hit();
    if constexpr (P::kSurface) complete_surface(hit, leaf_);
    return hit;
  }

 private:
  friend DeferredDecisions<HitSearch>;
  friend FilterAnswers<HitSearch>;

  /// Sets normal and error bound of a hit.
  /// @param leaf with the triangle; kInvalidRef: a custom primitive, whose own are transformed.
  HIPRT_HD HIPRT_FORCE_INLINE void complete_surface(Result& hit, NodeRef leaf) const {
    using Leaf = typename P::Layout::Leaf;
    const auto complete_in = [&](const BasicRay<Real>& ray, const std::byte* base) HIPRT_FORCE_INLINE_LAMBDA {
      if (leaf != kInvalidRef)
        complete<typename P::Layout>(hit, ray, *reinterpret_cast<const Leaf*>(base + ref_offset(leaf)), leaf & 1u);
    };
    if constexpr (P::kLevels == 0)
      complete_in(ray_.get(), scene_->base);
    else if (hit.found())
      complete_along<P::kMoves>(*scene_, hit, ray_.get(), complete_in);
  }

  HIPRT_HD HIPRT_FORCE_INLINE bool is_covered() const {
    if constexpr (requires { primitives_.covers(*scene_); })
      if (!primitives_.covers(*scene_)) return false;
    return covers<P>(*scene_) && (Primitives::kCount != 0 || (scene_->features & feature_bit(Feature::kCustom)) == 0);
  }

  HIPRT_HD HIPRT_FORCE_INLINE NodeRef root_of(const BasicRay<Real>& ray) const {
    if (!is_covered()) return kRefusedRef;
    return is_traceable(ray) ? scene_->root : kInvalidRef;
  }

  /// At most the largest finite number, so that an overflow of t is a miss.
  HIPRT_HD static HIPRT_FORCE_INLINE Real finite(Real tmax) {
    constexpr Real kMax = std::numeric_limits<Real>::max();
    return tmax < kMax ? tmax : kMax;
  }

  /// Triangles count from this t on.
  HIPRT_HD static HIPRT_FORCE_INLINE Real least_t(const BasicRay<Real>& ray,
                                                  [[maybe_unused]] const Primitives& primitives) {
    if constexpr (kCountsAnyT<Primitives>) return primitives.least_t;
    return max_of(ray.tmin, Real(0));
  }
  HIPRT_HD static HIPRT_FORCE_INLINE bool counts_at_any_t([[maybe_unused]] const LeafHit<Real>& found) {
    if constexpr (kCountsAnyT<Primitives>) return found.custom != nullptr;
    return false;
  }

  /// Whether another hit at the same t comes first, or a query has reported this hit already.
  ///
  /// Of hits at the same t the one with the lowest geometry, then the lowest primitive number wins.
  HIPRT_HD HIPRT_FORCE_INLINE bool loses_tie(const LeafHit<Real>& found) const {
    const std::uint32_t geometry = found.geometry, primitive = found.primitive;
    bool loses = found.at.t == limit_ &&
                 (geometry > hit_.geometry || (geometry == hit_.geometry && primitive >= hit_.primitive));
    bool seen = found.at.t == after_t_ && after_primitive_ != kInvalidId &&
                (geometry < after_geometry_ || (geometry == after_geometry_ && primitive <= after_primitive_));
    if constexpr (P::kLevels != 0) {
      // Paths are compared first.
      if (found.at.t == limit_ && hit_.found())
        if (const int order = hit_path_.compare(traversal_.levels()); order != 0) loses = order < 0;
      if (found.at.t == after_t_ && after_primitive_ != kInvalidId)
        if (const int order = after_path_.compare(traversal_.levels()); order != 0) seen = order > 0;
    }
    return loses || seen;
  }

  HIPRT_HD HIPRT_FORCE_INLINE bool take_closest(const LeafHit<Real>& found) {
    return found.at.t >= after_t_ && found.at.t <= limit_ && !loses_tie(found) && accept(found);
  }

  /// Takes the hit unless a mask or a filter rejects it.
  HIPRT_HD HIPRT_FORCE_INLINE bool accept(const LeafHit<Real>& found) {
    if (!is_visible<P>(*scene_, traversal_.levels(), ray_.get(), found.geometry)) return false;
    Result candidate;
    static_cast<BasicHit<Real>&>(candidate) =
        BasicHit<Real>{found.at.t, found.at.u, found.at.v, found.geometry, found.primitive};
    if constexpr (P::kLevels != 0 && kFilters) candidate.path = traversal_.levels().path();
    if (found.custom != nullptr) {
      candidate.normal = found.custom->normal;
      candidate.error = found.custom->error;
    }
    const FilterResult result = call_filters(found, candidate);
    if (result == FilterResult::kReject) return false;
    stopped_ = result == FilterResult::kAcceptAndStop;
    hit_ = candidate;
    hit_path_.save(traversal_.levels());
    leaf_ = found.custom == nullptr ? found.leaf : kInvalidRef;
    return true;
  }

  HIPRT_HD HIPRT_FORCE_INLINE FilterResult call_filters(const LeafHit<Real>& found, const Result& candidate) const {
    if (counts_at_any_t(found)) return FilterResult::kAccept;
    if constexpr (P::kLevels != 0 && kFilters)
      if (traversal_.levels().without_filter(*scene_)) return FilterResult::kAccept;
    bool stop = false;
    if constexpr (Primitives::kCount != 0) {
      if (found.custom != nullptr) {
        const unsigned type = geometry_type(traversal_.levels().geometry(*scene_, candidate.geometry).flags);
        const FilterResult result = primitives_.filter(type, ray_.get(), candidate);
        if (result == FilterResult::kReject) return result;
        stop = result == FilterResult::kAcceptAndStop;
      }
    }
    const FilterResult result =
        call_filter(filter_, ray_.get(), candidate, FilterAnswers<HitSearch>(*this, found, candidate));
    return result == FilterResult::kAccept && stop ? FilterResult::kAcceptAndStop : result;
  }

  HIPRT_HD HIPRT_FORCE_INLINE void conclude(bool found) {
    state_ = found ? TraversalState::kHit : without_hit();
    if (found) return;
    if constexpr (kCountsAnyT<Primitives>)
      if (state_ == TraversalState::kStackOverflow) return;  // The hit may be of use all the same.
    forget_hit();
    if (state_ == TraversalState::kFinished) return;
    hit_.t = std::numeric_limits<Real>::quiet_NaN();
    if constexpr (requires { storage_.on_overflow(); })
      if (state_ == TraversalState::kStackOverflow) storage_.on_overflow();
  }

  /// The state of a search without a hit.
  HIPRT_HD HIPRT_FORCE_INLINE TraversalState without_hit() const {
    if (kAsksViewAgain ? !is_covered() : traversal_.refused()) return TraversalState::kRefused;
    return traversal_.overflowed() ? TraversalState::kStackOverflow : TraversalState::kFinished;
  }

  /// kAsksViewAgain: without_hit() reads from the view whether the search was refused, and not from the traversal.
  /// Where the view is an argument of a kernel, that takes no register on NVIDIA's GPUs, and closest hits are 3 %
  /// faster (H100).
  ///
  /// kForgetsOutcome: find_any() reads from the hit whether the traversal has stopped. On gfx1030 (clang 15) that saves
  /// five to seven registers. On sm_90 (CUDA 13) it costs up to eleven.
#if defined(__CUDA_ARCH__)
  static constexpr bool kAsksViewAgain = !P::kViewInMemory, kForgetsOutcome = false;
#else
  static constexpr bool kAsksViewAgain = false, kForgetsOutcome = kKind == SearchKind::kOne;
#endif

  /// Whether filters are called for hits.
  static constexpr bool kFilters = !std::is_same_v<Filter, NoFilter> || Primitives::kCount != 0;
  /// Whether decisions are deferred (deferred_hits.h). WholeWave schedules do not defer: the registers cost more than
  /// it saves (docs/decisions/0018-exact-decisions.md).
  static constexpr bool kDefers = kKind == SearchKind::kClosest && !P::Schedule::kBatchOnly && P::kLevels == 0 &&
                                  !kFilters && !TraversalObserver<Counter> &&
                                  DeferringTest<typename P::Triangle, typename P::Layout, typename P::Lanes>;
  const SceneView* scene_;
  QueryRay<P::kLevels, Real> ray_;
  Storage storage_;
  Filter filter_;
  Primitives primitives_;
  Counter counter_;
  Traversal<P, Order, kResumable, SearchTest<kDefers, typename P::Triangle>> traversal_;
  BasicHit<Real> hit_{};
  SavedPath<P::kLevels> hit_path_, after_path_;
  Real after_t_;                               ///< The search accepts hits from this t on.
  std::uint32_t after_geometry_ = kInvalidId;  ///< At after_t_ only hits behind this one count; kInvalidId: all.
  std::uint32_t after_primitive_ = kInvalidId;
  Real limit_;
  DeferredHits<kDefers, Real> deferred_;
  NodeRef leaf_ = kInvalidRef;  ///< The leaf with the triangle of hit_ (LeafHit::leaf).
  bool stopped_ = false;        ///< The filter ended the search with the last hit.
  TraversalState state_ = TraversalState::kInit;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
