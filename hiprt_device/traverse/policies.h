#pragma once
/// The compile-time choices of a tracer, as named members of one struct.

#include <hiprt_device/intersect/triangle_test.h>
#include <hiprt_device/math/lanes.h>
#include <hiprt_device/scene_view.h>
#include <hiprt_device/traverse/child_order.h>
#include <hiprt_device/traverse/counter.h>
#include <hiprt_device/traverse/schedule.h>
#include <hiprt_device/traverse/stacks/level_stack.h>
#include <hiprt_device/traverse/stacks/private.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// A box test: margin() says by how much boxes grow, in scene units, for a ray's origin and the scene's bounds.
template <class T>
concept BoxTest = requires(const Vec3& origin, const Box& bounds) {
  { T::margin(origin, bounds) } -> std::same_as<float>;
};

/// A box test that returns a node's children in the order in which to visit them. Its order is AsTested
/// (amd_ray_test.h). Choice is what it decides once per ray.
template <class T, class Layout, class Lanes>
concept SortingBoxTest = BoxTest<T> &&
    requires(const SceneView& scene, NodeRef node, const Ray& ray, const RaySlabs<Lanes>& slabs,
             const typename T::Choice& choice, float limit) {
  { T::template intersect<Layout>(scene, node, ray, slabs, choice, limit) } -> std::same_as<SortedChildren>;
};

/// A triangle test: a form of the ray that is prepared once, and intersect().
///
/// intersect() calls accept(candidate, i) for each triangle i (0 or 1) of the leaf that the ray's line meets, at any
/// t. It returns false as soon as accept does.
/// @tparam Real of the rays and candidates.
template <class T, class Layout, class Lanes, class Real>
concept TriangleTest = requires(const typename Layout::Leaf& leaf, const LeafInfo& info,
                                const typename T::template PreparedRay<Lanes>& ray,
                                bool (*accept)(const BasicCandidate<Real>&, unsigned)) {
  { T::template intersect<Lanes>(leaf, info, ray, accept) } -> std::same_as<bool>;
};

/// A triangle test that can defer its decision.
///
/// Bounds is a test of the same prepared rays. The t of its candidates is an upper bound, their u a lower bound of t.
/// If these are not finite the line may miss the triangle. decide() gives for one triangle the result of intersect().
template <class T, class Layout, class Lanes>
concept DeferringTest = TriangleTest<typename T::Bounds, Layout, Lanes, float> &&
    requires(const typename Layout::Leaf& leaf, const typename T::template PreparedRay<Lanes>& ray, Candidate& at) {
  { T::template decide<Lanes>(leaf, ray, false, 0u, at) } -> std::same_as<bool>;
};

/// A counter: it is called for every test of four boxes, and for every leaf test with its number of triangles (1 or
/// 2).
template <class T>
concept WorkCounting = requires(T counter) {
  counter.on_boxes();
  counter.on_leaf(2u);
};

/// The accurate defaults. A tracer's own policies derive from it and replace members by name:
///
///     struct Mine : hiprt::Policies {
///       using Layout = hiprt::QuantizedLayout;
///       using Stack = hiprt::RollingStack<8>;
///       using Schedule = hiprt::Postponed;
///     };
///     hiprt::Hit hit = hiprt::closest_hit<Mine>(scene, ray, storage);
struct Policies {
  using Real = float;              ///< Precision of rays. For double see query/double_rays.h.
  using Layout = PlanesLayout;     ///< FloatLayout, PlanesLayout, HalfLayout or QuantizedLayout; the scene's layout.
  using Triangle = Watertight;     ///< Watertight, Fast or Reference (intersect/exact_triangle_test.h).
  using Boxes = Conservative;      ///< Conservative or Plain. For HardwareBoxes see intersect/amd_ray_test.h.
  using Stack = PrivateStack<>;    ///< Where the traversal keeps the nodes to visit later (traverse/stacks).
  using Lanes = DefaultLanes;      ///< SimdLanes (host) or ArrayLanes; both find the same hits.
  using Counter = NoCounter;       ///< NoCounter, WorkCounter or an observer (counter.h).
  using Schedule = Immediate;      ///< Immediate, Postponed or WholeWave<> (schedule.h).
  using ClosestOrder = NearFirst;  ///< Order of children for closest hits (child_order.h).
  using AnyOrder = Unordered;      ///< Order of children for any and all hits.
  /// Features that the tracer has code for. covers() says whether they suffice for a scene.
  static constexpr FeatureMask kFeatures = kKnownFeatures;
  /// Whether closest and all hits on triangles have a normal and an error bound. If not, both are 0 and cost nothing.
  static constexpr bool kSurface = true;
  /// Whether the SceneView lies in global memory, where loads take long, and not among the kernel's arguments. Then a
  /// register keeps what every node needs of it.
  static constexpr bool kViewInMemory = false;
  /// Number of nested instances that a ray may be in. 0: no code for instances. Instanced<> sets it.
  static constexpr unsigned kLevels = 0;
  /// Whether instances may move. false: no code for motion. Moving<> sets it.
  static constexpr bool kMoves = false;
};

/// Policies with another node layout, for code that handles several layouts.
///
///     hiprt::closest_hit<hiprt::WithLayout<hiprt::HalfLayout>>(scene, ray);
template <class LayoutPolicy, class Base = Policies> struct WithLayout : Base { using Layout = LayoutPolicy; };

/// Policies for scenes of instances with up to @p kMost levels.
///
/// With one level, objects hold triangles and custom primitives. With two levels, objects may also hold instances of
/// such objects, and so on. SceneView::levels is the number of levels of a scene.
///
///     using Tracer = hiprt::Instanced<hiprt::Policies, 2>;
template <class Base = Policies, unsigned kMost = 1> struct Instanced : Base {
  static_assert(kMost != 0, "hiprt: Instanced needs at least one level; use Base itself for none");
  using Stack = LevelStack<typename Base::Stack, kMost, typename Base::Real>;
  static constexpr FeatureMask kFeatures = Base::kFeatures | feature_bit(Feature::kInstances);
  static constexpr unsigned kLevels = kMost;
};

/// Policies for scenes whose instances move (Ray::time).
///
///     using Tracer = hiprt::Moving<hiprt::Instanced<hiprt::Policies>>;
template <class Base = Instanced<>> struct Moving : Base {
  static_assert(Base::kLevels != 0, "hiprt: Moving needs levels of instances: write Moving<Instanced<...>>");
  static constexpr FeatureMask kFeatures = Base::kFeatures | feature_bit(Feature::kMotion);
  static constexpr bool kMoves = true;
};

/// All requirements of a tracer's policies.
template <class P>
concept PolicySet = BoxTest<typename P::Boxes> && TraversalStack<typename P::Stack> &&
    WorkCounting<typename P::Counter> && TraversalSchedule<typename P::Schedule> &&
    TriangleTest<typename P::Triangle, typename P::Layout, typename P::Lanes, typename P::Real> &&
    TraversalOrder<typename P::ClosestOrder, typename P::Stack, typename P::Lanes> &&
    TraversalOrder<typename P::AnyOrder, typename P::Stack, typename P::Lanes> && requires {
  { P::kFeatures } -> std::convertible_to<FeatureMask>;
  { P::kLevels } -> std::convertible_to<unsigned>;
  { P::kMoves } -> std::convertible_to<bool>;
  { P::kSurface } -> std::convertible_to<bool>;
  { P::kViewInMemory } -> std::convertible_to<bool>;
};

/// Whether a tracer with policies P can trace the scene: its layout, its features and its levels.
template <class P> HIPRT_HD constexpr bool covers(const SceneView& scene) {
  const FeatureMask without =
      (P::kLevels == 0 ? feature_bit(Feature::kInstances) : 0) | (P::kMoves ? 0 : feature_bit(Feature::kMotion));
  const FeatureMask features = (P::kFeatures & ~without) | kFeaturesWithoutCode;
  return scene.layout == P::Layout::kId && (scene.features & ~features) == 0 && scene.levels <= P::kLevels;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
