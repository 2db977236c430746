#pragma once
/// The closest hit and any hit of one ray, by HostNodes. Internal; for sources compiled with AVX2 and FMA.
///
/// The loop is that of hiprt_device/traverse, for flat scenes, one stack and one layout. References are addresses, and
/// what they name is prefetched as soon as the ray has met its box.

#include <hiprt_build/host/host_leaves.h>
#include <hiprt_build/host/host_node.h>
#include <hiprt_device/format/layout.h>
#include <hiprt_device/intersect/hit_surface.h>
#include <hiprt_device/scene_view.h>

#include <type_traits>

namespace hiprt::format_detail {
inline namespace HIPRT_ISA_NAMESPACE {

/// A node to visit later. @tparam kSorted whether its distance is kept.
template <bool kSorted> struct HostEntry {
  HostRef ref;
  float enter;
};
template <> struct HostEntry<false> { HostRef ref; };

/// The children that a ray meets, and where.
struct HostBoxes {
  std::uint32_t met;
  WideLanes::Float enter;
};

/// Tests a node's boxes. @param ray whose limit is `limit`; both as WideLanes::Float.
HIPRT_FORCE_INLINE HostBoxes meet_boxes(const HostNode& node, const HostRay& ray, WideLanes::Float tmin,
                                        WideLanes::Float limit) {
  using Lanes = WideLanes;
  const char* const first_plane = reinterpret_cast<const char*>(&node);
  const auto planes = [&](std::size_t at) { return Lanes::load(reinterpret_cast<const float*>(first_plane + at)); };
  const auto enter = [&](unsigned k) { return Lanes::fma(planes(ray.near_planes[k]), ray.rcp[k], ray.near_offset[k]); };
  const auto leave = [&](unsigned k) {
    return Lanes::fma(planes(far_planes(ray.near_planes[k])), ray.rcp[k], ray.far_offset[k]);
  };
  const auto first = Lanes::first_in(enter(0), enter(1), enter(2), tmin);
  const auto last = Lanes::last_in(leave(0), leave(1), leave(2), limit);
  return {Lanes::not_later(first, last), first};
}

HIPRT_FORCE_INLINE void prefetch(HostRef ref) {
  for (unsigned line = 0; line < sizeof(HostNode) / 64; ++line) __builtin_prefetch(ref.address() + 64 * line);
}

/// A search of one ray. @tparam kClosest the closest hit; false: any hit.
template <bool kClosest> class HostSearch {
  using Lanes = WideLanes;
  using Entry = HostEntry<kClosest>;

 public:
  /// @pre current_host_scene(scene) is not nullptr
  HIPRT_FORCE_INLINE HostSearch(const SceneView& scene, const Ray& ray) : scene_(&scene), ray_(&ray) {
    top_ = stack_;
    push(HostRef::none(), -std::numeric_limits<float>::infinity());
    next_ = prepare(*scene.host, ray, prepared_) ? HostRef(scene.host->nodes) : HostRef::none();
  }

  HIPRT_FORCE_INLINE Hit run() {
    while (find_leaf())
      if (!test_leaves()) break;
    return hit();
  }

  /// Visits a node, or tests leaves. Then other rays are traced while memory is read for this one.
  /// @return false: the search has ended.
  HIPRT_FORCE_INLINE bool step() {
    if (next_.is_node())
      visit();
    else if (next_.is_none() || !test_leaves())
      return false;
    return true;
  }

  HIPRT_FORCE_INLINE Hit hit() const {
    Hit hit;
    if (found_.leaf == nullptr) return hit;
    hit = {at_.t, at_.u, at_.v, found_.geometry(), found_.primitive(), {}, 0.0f};
    if constexpr (kClosest) complete<PlanesLayout>(hit, *ray_, *found_.leaf, found_.triangle);
    return hit;
  }

 private:
  HIPRT_FORCE_INLINE void push(HostRef ref, [[maybe_unused]] float enter) {
    if constexpr (kClosest)
      *top_++ = {ref, enter};
    else
      *top_++ = {ref};
  }
  HIPRT_FORCE_INLINE void pop() {
    if constexpr (kClosest)
      while (!((--top_)->enter <= prepared_.limit)) {
      }
    else
      --top_;
    next_ = top_->ref;
  }

  /// @return whether there is one.
  HIPRT_FORCE_INLINE bool find_leaf() {
    while (next_.is_node()) visit();
    return !next_.is_none();
  }

  HIPRT_FORCE_INLINE void visit() {
    const HostNode& node = *next_.node();
    const HostBoxes boxes =
        meet_boxes(node, prepared_, Lanes::all(prepared_.tmin), Lanes::all(max_of(prepared_.limit, 0.0f)));
    std::uint32_t met = boxes.met;
    if (met == 0) return pop();
    const unsigned first = take(met);
    next_ = node.child[first];
    prefetch(next_);
    if (met == 0) return;
    if constexpr (kClosest) {
      alignas(32) float enter[kWideBranching];
      Lanes::store(enter, boxes.enter);
      visit_nearest_first(node, enter, first, met);
    } else {
      do {
        const HostRef child = node.child[take(met)];
        prefetch(child);
        push(child, 0.0f);
      } while (met != 0);
    }
  }

  /// Makes the nearest child the next one and pushes the others, the farthest first.
  /// @param first a met child, which is next_. @param others the other ones; not 0.
  HIPRT_FORCE_INLINE void visit_nearest_first(const HostNode& node, const float (&enter)[kWideBranching], unsigned first,
                                              std::uint32_t others) {
    const auto entry = [&](unsigned child) {
      prefetch(node.child[child]);
      return Entry{node.child[child], enter[child]};
    };
    Entry nearest{next_, enter[first]}, second = entry(take(others));
    sort(nearest, second);
    next_ = nearest.ref;
    if (others == 0) {
      *top_++ = second;
      return;
    }
    Entry third = entry(take(others));
    sort(second, third);
    sort(nearest, second);
    next_ = nearest.ref;
    if (others == 0) {
      top_[0] = third;
      top_[1] = second;
      top_ += 2;
      return;
    }
    // Insertion, the farthest at the bottom.
    Entry* const bottom = top_;
    top_[0] = third;
    top_[1] = second;
    top_[2] = nearest;
    top_ += 3;
    do {
      const Entry later = entry(take(others));
      Entry* at = top_++;
      for (; at != bottom && at[-1].enter < later.enter; --at) at[0] = at[-1];
      *at = later;
    } while (others != 0);
    next_ = (--top_)->ref;
  }

  /// Tests the leaves of next_ and pops what to visit next.
  /// @return false: a hit ends the search.
  HIPRT_FORCE_INLINE bool test_leaves() {
    const auto offer = [&](const Candidate& at, const HostTriangle& triangle) HIPRT_FORCE_INLINE_LAMBDA {
      if (!(at.t >= prepared_.tmin && at.t <= prepared_.limit) || loses_tie(at.t, triangle) || !is_visible(triangle))
        return true;
      at_ = at;
      found_ = triangle;
      prepared_.limit = at.t;
      return kClosest;
    };
    const PlanesLeaf* leaves = next_.leaves();
    if (next_.is_long_run()) [[unlikely]] {
      for (;; ++leaves) {
        if (!meet_leaves(leaves, 1, *ray_, prepared_, offer)) return false;
        if ((leaves->info.geometry_and_flags & kLastInRun) != 0) break;
      }
    } else {
      const unsigned count = next_.leaf_count();
      if (!meet_leaves(leaves, count < 2 ? 1 : 2, *ray_, prepared_, offer)) return false;
      if (count > 2 && !meet_leaves(leaves + 2, count - 2, *ray_, prepared_, offer)) return false;
    }
    pop();
    return true;
  }

  /// Of hits at the same t the one with the lowest geometry, then the lowest primitive number wins.
  HIPRT_FORCE_INLINE bool loses_tie(float t, const HostTriangle& triangle) const {
    if (!kClosest || t != prepared_.limit || found_.leaf == nullptr) return false;
    const std::uint32_t geometry = triangle.geometry(), before = found_.geometry();
    return geometry > before || (geometry == before && triangle.primitive() >= found_.primitive());
  }
  HIPRT_FORCE_INLINE bool is_visible(const HostTriangle& triangle) const {
    return (scene_->features & feature_bit(Feature::kMasks)) == 0 ||
           (scene_->geometries[triangle.geometry()].mask & ray_->mask) != 0;
  }

  HIPRT_FORCE_INLINE static unsigned take(std::uint32_t& mask) {
    const unsigned lowest = static_cast<unsigned>(std::countr_zero(mask));
    mask &= mask - 1;
    return lowest;
  }
  HIPRT_FORCE_INLINE static void sort(Entry& nearer, Entry& farther) {
    const bool swap = farther.enter < nearer.enter;
    const Entry a = nearer, b = farther;
    nearer.ref = swap ? b.ref : a.ref;
    nearer.enter = swap ? b.enter : a.enter;
    farther.ref = swap ? a.ref : b.ref;
    farther.enter = swap ? a.enter : b.enter;
  }

  const SceneView* scene_;
  const Ray* ray_;
  HostRay prepared_;
  HostRef next_;
  Entry* top_;
  Candidate at_{};
  HostTriangle found_;
  Entry stack_[kHostStack + 1];
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::format_detail
