#pragma once
/// The closest hit and any hit of one ray, by HostNodes. Internal; for sources compiled with AVX2 and FMA.
///
/// The loop is that of hiprt_device/traverse, for flat scenes, one stack and one layout. References are addresses, and
/// what they name is prefetched as soon as the ray has met its box.

#include <hiprt_build/host/host_leaves.h>
#include <hiprt_build/host/host_stack.h>
#include <hiprt_build/host/host_surface.h>
#include <hiprt_device/scene_view.h>

namespace hiprt::format_detail {
inline namespace HIPRT_ISA_NAMESPACE {

/// Of hits at the same t the one with the lowest geometry, then the lowest primitive number wins.
/// @param limit t of the hit that is known, or tmax. @param known its triangle, if there is one.
HIPRT_FORCE_INLINE bool loses_tie(float t, float limit, const HostTriangle& triangle, const HostTriangle& known) {
  if (t != limit || known.leaf == nullptr) return false;
  const std::uint32_t geometry = triangle.geometry(), before = known.geometry();
  return geometry > before || (geometry == before && triangle.primitive() >= known.primitive());
}

HIPRT_FORCE_INLINE bool is_visible(const SceneView& scene, const Ray& ray, const HostTriangle& triangle) {
  return (scene.features & feature_bit(Feature::kMasks)) == 0 ||
         (scene.geometries[triangle.geometry()].mask & ray.mask) != 0;
}

/// @param found its triangle, if there is one. @tparam kClosest whether the hit has normal and error.
template <bool kClosest>
HIPRT_FORCE_INLINE Hit host_hit(const Ray& ray, float t, float u, float v, const HostTriangle& found) {
  Hit hit;
  if (found.leaf == nullptr) return hit;
  hit = {t, u, v, found.geometry(), found.primitive(), {}, 0.0f};
  if constexpr (kClosest) complete_on_host(hit, ray, found);
  return hit;
}

/// A search of one ray. @tparam kClosest the closest hit; false: any hit.
template <bool kClosest> class HostSearch {
  using Lanes = WideLanes;

 public:
  /// @pre current_host_scene(scene) is not nullptr
  HIPRT_FORCE_INLINE HostSearch(const SceneView& scene, const Ray& ray)
      : scene_(&scene),
        ray_(&ray),
        cursor_(stack_.start(prepare(*scene.host, ray, prepared_) ? HostRef(scene.host->nodes) : HostRef::none())) {}

  HIPRT_FORCE_INLINE Hit run() {
    Cursor at = cursor_;
    for (;;) {
      if (at.next.is_node()) {
        // A copy stays in registers: no leaf test can change it here.
        const HostSlabs slabs = prepared_.slabs;
        const float limit = prepared_.limit;
        do visit(slabs, limit, at);
        while (at.next.is_node());
      }
      if (at.next.is_none() || !test_leaves(at)) break;
    }
    return hit();
  }

  /// Visits a node, or tests leaves. Then other rays are traced while memory is read for this one.
  /// @return false: the search has ended.
  HIPRT_FORCE_INLINE bool step() {
    if (cursor_.next.is_node())
      visit(prepared_.slabs, prepared_.limit, cursor_);
    else if (cursor_.next.is_none() || !test_leaves(cursor_))
      return false;
    return true;
  }

  HIPRT_FORCE_INLINE Hit hit() const { return host_hit<kClosest>(*ray_, t_, u_, v_, found_); }

 private:
  using Cursor = typename HostStack<kClosest>::Cursor;

  HIPRT_FORCE_INLINE static void visit(const HostSlabs& slabs, float limit, Cursor& at) {
    const HostNode& node = *at.next.node();
    at.visit(node, meet_boxes(node, slabs), limit);
  }
  HIPRT_FORCE_INLINE static HostBoxes meet_boxes(const HostNode& node, const HostSlabs& slabs) {
    const char* const first_plane = reinterpret_cast<const char*>(&node);
    const auto planes = [&](std::size_t at) { return Lanes::load(reinterpret_cast<const float*>(first_plane + at)); };
    const auto enter = [&](unsigned k) {
      return Lanes::fma(planes(slabs.near_planes[k]), slabs.rcp[k], slabs.near_offset[k]);
    };
    const auto leave = [&](unsigned k) {
      return Lanes::fma(planes(far_planes(slabs.near_planes[k])), slabs.rcp[k], slabs.far_offset[k]);
    };
    const auto first = Lanes::first_in(enter(0), enter(1), enter(2), slabs.begin);
    const auto last = Lanes::last_in(leave(0), leave(1), leave(2), slabs.end);
    return {Lanes::not_later(first, last), first};
  }

  /// Tests the leaves that are next and pops what follows.
  /// @return false: a hit ends the search.
  HIPRT_FORCE_INLINE bool test_leaves(Cursor& at) {
    const auto offer = [&](const Candidate& candidate, const HostTriangle& triangle) HIPRT_FORCE_INLINE_LAMBDA {
      if (!(candidate.t >= prepared_.tmin && candidate.t <= prepared_.limit) || !is_visible(*scene_, *ray_, triangle) ||
          (kClosest && loses_tie(candidate.t, prepared_.limit, triangle, found_)))
        return true;
      // Not as one struct: its copy would wait for the stores of its members.
      t_ = candidate.t;
      u_ = candidate.u;
      v_ = candidate.v;
      found_ = triangle;
      prepared_.set_limit(candidate.t);
      return kClosest;
    };
    const PlanesLeaf* leaves = at.next.leaves();
    if (at.next.is_long_run()) [[unlikely]] {
      for (;; ++leaves) {
        if (!meet_leaves(leaves, 1, *ray_, prepared_, offer)) return false;
        if ((leaves->info.geometry_and_flags & kLastInRun) != 0) break;
      }
    } else {
      const unsigned count = at.next.leaf_count();
      if (!meet_leaves(leaves, count < 2 ? 1 : 2, *ray_, prepared_, offer)) return false;
      if (count > 2 && !meet_leaves(leaves + 2, count - 2, *ray_, prepared_, offer)) return false;
    }
    at.pop(prepared_.limit);
    return true;
  }

  const SceneView* scene_;
  const Ray* ray_;
  HostRay prepared_;
  float t_, u_, v_;
  HostTriangle found_;
  HostStack<kClosest> stack_;
  Cursor cursor_;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::format_detail
