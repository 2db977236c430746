#pragma once
/// The traversal of a tree by a region of space: the ball around a point, a box, a frustum.
///
/// It is the ray's loop without a ray. Node and leaf records, stacks, orders, levels and masks are those of rays. The
/// region says which children may have something in it, and how far they are.

#include <hiprt_device/instances/levels.h>
#include <hiprt_device/instances/placed_vertices.h>
#include <hiprt_device/traverse/policies.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// A triangle that a region comes to.
struct RegionTriangle {
  Vec3D corner[3];  ///< In the scene, in the mesh's order.
  std::uint32_t geometry, primitive;
};

/// A custom primitive that a region comes to.
struct RegionCustom {
  std::uint32_t geometry, primitive;
};

/// For queries that refuse scenes with custom primitives.
struct NoCustoms {};

/// The policies that a region's traversal reads: Real, Layout, Lanes, Stack, orders, Counter, features and levels.
/// Triangle, Boxes, Schedule and kSurface are those of rays.
///
/// A Region has these members:
///
///     boxes(node)               BoxHits: the children that may have something in the region, with distances that the
///                               order and the stack compare
///     far_end()                 the largest such distance that counts; it may fall, never rise
///     outside(leaf)             bit i: triangle i of the leaf has certainly nothing in the region
///     outside(box)              whether a custom primitive's box has; only for queries that take such primitives
///     enter(record, object)     continues in an object, as an instance places it
///     leave()                   back to where the instance is
/// @tparam Order P::ClosestOrder or P::AnyOrder.
template <class P, class Order> class RegionTraversal {
  using Layout = typename P::Layout;
  using Node = typename Layout::Node;
  using Leaf = typename Layout::Leaf;
  using Lanes = typename P::Lanes;
  using Backtrack = BacktrackOf<typename P::Stack, typename Order::Entry>;
  using LevelsOf = Levels<P::kLevels, P::kMoves, typename P::Real>;
  static constexpr bool kHasLevels = P::kLevels != 0;
  static_assert(DistanceOrder<Order, typename P::Stack, Lanes>,
                "hiprt: regions need an order that compares distances: NearFirst, NearestFirst or Unordered");
  static_assert(!kHasLevels || !BacktrackingStack<typename P::Stack>,
                "hiprt: Instanced cannot be used with a restart trail or a box test that sorts");

 public:
  /// @param root the scene's root; or kInvalidRef or kRefusedRef: then nothing is visited.
  HIPRT_HD HIPRT_FORCE_INLINE RegionTraversal(const SceneView& scene, NodeRef root,
                                              const typename P::Stack::Storage& storage)
      : levels_(scene, storage), backtrack_(storage, root), node_(root) {}

  /// Visits the triangles of the leaves that may have something in the region.
  /// @param mask, time of the query: instances that the mask hides are not entered.
  /// @param visit bool(const RegionTriangle&): false stops for good.
  /// @param customs bool(const RegionCustom&), the same; or NoCustoms.
  /// @return false if the visitor stopped.
  template <class Region, class Visit, class Customs = NoCustoms>
  HIPRT_HD HIPRT_FORCE_INLINE bool run(const SceneView& scene, Region& region, std::uint32_t mask, float time,
                                       typename P::Counter& counter, Visit&& visit, const Customs& customs = {}) {
    const auto visit_leaves = [&]() HIPRT_FORCE_INLINE_LAMBDA {
      if constexpr (kTakesCustoms<Customs>)
        if (ref_type(node_) == NodeType::kProcedural) return visit_customs(scene, region, customs);
      return visit_run(scene, region, counter, visit);
    };
    for (;;) {
      while (is_box(node_)) node_ = visit_boxes(scene, region, counter);
      if (is_end(node_)) return true;
      if constexpr (kHasLevels) {
        if (node_ == kExitRef) {
          levels_.leave(scene);
          placed_.leave();
          region.leave();
        } else if (is_instance<Customs>(scene)) {
          if (enter(scene, region, mask, time, counter)) continue;
          if (is_end(node_)) return true;
        } else if (!visit_leaves()) {
          return false;
        }
      } else if (!visit_leaves()) {
        return false;
      }
      node_ = backtrack_.pop(region.far_end());
    }
  }

  HIPRT_HD HIPRT_FORCE_INLINE bool overflowed() const { return node_ == kOverflowRef; }
  HIPRT_HD HIPRT_FORCE_INLINE bool refused() const { return node_ == kRefusedRef; }
  HIPRT_HD HIPRT_FORCE_INLINE const LevelsOf& levels() const { return levels_; }
  HIPRT_HD HIPRT_FORCE_INLINE const PlacedVertices<P::kLevels>& placed() const { return placed_; }

 private:
  template <class Customs> static constexpr bool kTakesCustoms = !std::is_same_v<Customs, NoCustoms>;

  /// Whether the leaf at node_ is an instance's.
  template <class Customs> HIPRT_HD HIPRT_FORCE_INLINE bool is_instance(const SceneView& scene) const {
    if constexpr (kTakesCustoms<Customs>)
      if (levels_.instances(scene) == nullptr) return false;
    return ref_type(node_) == NodeType::kProcedural;
  }

  template <class Region>
  HIPRT_HD HIPRT_FORCE_INLINE NodeRef visit_boxes(const SceneView& scene, const Region& region,
                                                  typename P::Counter& counter) {
    counter.on_boxes();
    const Node& node = *reinterpret_cast<const Node*>(levels_.base(scene) + ref_offset(node_));
    const BoxHits<Lanes> hits = region.boxes(node);
    if (!hits.any()) return backtrack_.pop(region.far_end());
    if constexpr (Lanes::kScalar)
      return Order::next(load_words(node.child).word, hits, backtrack_);
    else
      return Order::next(node.child, hits, backtrack_);
  }

  /// Visits the custom primitives of the run at node_. @return false if the visitor stopped.
  template <class Region, class Customs>
  HIPRT_HD HIPRT_FORCE_INLINE bool visit_customs(const SceneView& scene, const Region& region, const Customs& customs) {
    const std::byte* record = levels_.base(scene) + ref_offset(node_);
    for (;; record += kNodeGranularity) {
      const CustomLeaf& leaf = *reinterpret_cast<const CustomLeaf*>(record);
      const LeafInfo info = load_info(record);
      for (unsigned slot = 0; slot < 2; ++slot) {
        const std::uint32_t primitive = choose(slot == 0, info.primitive[0], info.primitive[1]);
        if (primitive == kInvalidId || region.outside(leaf.box[slot])) continue;
        if (!customs(RegionCustom{info.geometry_and_flags & kGeometryMask, primitive})) return false;
      }
      if ((info.geometry_and_flags & kLastInRun) != 0) return true;
    }
  }

  /// Visits the triangles of the run at node_. @return false if the visitor stopped.
  template <class Region, class Visit>
  HIPRT_HD HIPRT_FORCE_INLINE bool visit_run(const SceneView& scene, const Region& region, typename P::Counter& counter,
                                             Visit&& visit) {
    const std::byte* record = levels_.base(scene) + ref_offset(node_);
    for (;; record += kNodeGranularity) {
      const LeafInfo info = load_info(record);
      const bool is_pair = info.primitive[1] != kInvalidId;
      counter.on_leaf(is_pair ? 2u : 1u);
      const Leaf& leaf = *reinterpret_cast<const Leaf*>(record);
      const std::uint32_t outside = region.outside(leaf);
      if ((outside & 1u) == 0 && !visit_triangle(leaf, info, 0, visit)) return false;
      if (is_pair && (outside & 2u) == 0 && !visit_triangle(leaf, info, 1, visit)) return false;
      if ((info.geometry_and_flags & kLastInRun) != 0) return true;
    }
  }
  template <class Visit>
  HIPRT_HD HIPRT_FORCE_INLINE bool visit_triangle(const Leaf& leaf, const LeafInfo& info, unsigned slot,
                                                  Visit&& visit) const {
    unsigned vertex[3] = {corner_vertex(slot, 0), corner_vertex(slot, 1), corner_vertex(slot, 2)};
    to_mesh_order(vertex, info.triangle_ids >> (8 * slot));
    const auto corner = [&](unsigned k) HIPRT_FORCE_INLINE_LAMBDA {
      const auto at = [&](unsigned axis) HIPRT_FORCE_INLINE_LAMBDA {
        return static_cast<double>(Layout::coordinate(leaf, vertex[k], axis));
      };
      return placed_.to_scene(Vec3D(at(0), at(1), at(2)));
    };
    return visit(RegionTriangle{{corner(0), corner(1), corner(2)},
                                info.geometry_and_flags & kGeometryMask,
                                choose(slot == 0, info.primitive[0], info.primitive[1])});
  }

  /// Enters the object of the instance at node_, if the query sees it.
  /// @return whether node_ is in the object now. If not, node_ is kOverflowRef or still the instance's leaf.
  template <class Region>
  HIPRT_HD HIPRT_FORCE_INLINE bool enter(const SceneView& scene, Region& region, std::uint32_t mask, float time,
                                         typename P::Counter& counter) {
    const CustomLeaf& leaf = *reinterpret_cast<const CustomLeaf*>(levels_.base(scene) + ref_offset(node_));
    const LeafInfo info = load_info(reinterpret_cast<const std::byte*>(&leaf));
    const std::uint32_t instance = info.primitive[0];
    if constexpr (requires { counter.on_instance(); }) counter.on_instance();
    const ObjectRecord* const outside = P::kLevels > 1 ? levels_.object() : nullptr;
    const ObjectView view = outside == nullptr ? ObjectView(scene) : ObjectView(scene, *outside);
    const InstanceRecord record = view.template instance<P::kMoves>(instance, time);
    if ((record.mask & mask) == 0) return false;
    if (!backtrack_.reserve()) {
      node_ = kOverflowRef;
      return false;
    }
    if constexpr (std::is_same_v<typename Order::Entry, NodeRef>)
      backtrack_.later(kExitRef);
    else
      backtrack_.later(make_entry(0.0f, kExitRef));
    const ObjectRecord& object = scene.objects[record.object];
    levels_.enter(scene, instance, object, BasicRay<typename P::Real>{});
    placed_.enter(record);
    region.enter(record, object);
    node_ = entered_ref(info);
    return true;
  }

  LevelsOf levels_;
  [[no_unique_address]] PlacedVertices<P::kLevels> placed_;
  Backtrack backtrack_;
  NodeRef node_;  ///< The node to visit next.
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
