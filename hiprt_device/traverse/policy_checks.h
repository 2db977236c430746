#pragma once
/// Checks policies before anything else is compiled. So the first message names the wrong member and its requirement.

#include <hiprt_device/filter.h>
#include <hiprt_device/primitives/primitive_table.h>
#include <hiprt_device/traverse/policies.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace policy_detail {

template <class T>
concept IsLayout = requires {
  { T::kId } -> std::convertible_to<NodeLayout>;
  typename T::Node;
  typename T::Leaf;
};
template <class T>
concept IsLanes = requires {
  typename T::Float;
  typename T::Scalar;
  { T::kScalar } -> std::convertible_to<bool>;
};

}  // namespace policy_detail

/// One assertion per member of Policies. The queries instantiate it first.
template <class P> struct PolicyCheck {
  static_assert(std::is_same_v<typename P::Real, float> || std::is_same_v<typename P::Real, double>,
                "hiprt: Policies::Real must be float or double");
  static_assert(policy_detail::IsLayout<typename P::Layout>,
                "hiprt: Policies::Layout must be FloatLayout, PlanesLayout, HalfLayout or QuantizedLayout");
  static_assert(policy_detail::IsLanes<typename P::Lanes>, "hiprt: Policies::Lanes must be SimdLanes or ArrayLanes");
  static_assert(
      BoxTest<typename P::Boxes>,
      "hiprt: Policies::Boxes needs float margin(const Vec3& origin, const Box& bounds); see concept BoxTest");
  static_assert(TriangleTest<typename P::Triangle, typename P::Layout, typename P::Lanes, typename P::Real>,
                "hiprt: Policies::Triangle needs PreparedRay<Lanes> and intersect() for the rays' Real; see concept "
                "TriangleTest");
  static_assert(TraversalStack<typename P::Stack>,
                "hiprt: Policies::Stack needs Storage and Of<Entry> with has_room(), push(), pop() and empty(); see "
                "concept TraversalStack");
  static_assert(WorkCounting<typename P::Counter>,
                "hiprt: Policies::Counter needs on_boxes() and on_leaf(unsigned triangles); see concept WorkCounting");
  static_assert(TraversalSchedule<typename P::Schedule>,
                "hiprt: Policies::Schedule needs kTogether, kBatchOnly and group(), and if kTogether search_on() and "
                "leaves(); see concept TraversalSchedule");
  static_assert(TraversalOrder<typename P::ClosestOrder, typename P::Stack, typename P::Lanes>,
                "hiprt: Policies::ClosestOrder needs Entry and next(children, hits, backtrack); see concept "
                "TraversalOrder");
  static_assert(
      TraversalOrder<typename P::AnyOrder, typename P::Stack, typename P::Lanes>,
      "hiprt: Policies::AnyOrder needs Entry and next(children, hits, backtrack); see concept TraversalOrder");
  static_assert(
      requires {
        { P::kFeatures } -> std::convertible_to<FeatureMask>;
        { P::kLevels } -> std::convertible_to<unsigned>;
        { P::kMoves } -> std::convertible_to<bool>;
        { P::kSurface } -> std::convertible_to<bool>;
        { P::kViewInMemory } -> std::convertible_to<bool>;
      },
      "hiprt: policies need kFeatures, kLevels, kMoves, kSurface and kViewInMemory: derive them from hiprt::Policies");

  static constexpr bool kChecked = true;
  using Real = typename P::Real;
  using Ray = BasicRay<Real>;
  using Storage = typename P::Stack::Storage;
};

/// Checks the template arguments of a query.
/// @tparam Filter, Primitives as those of ClosestHit.
template <class P, class Filter, class Primitives> struct QueryCheck {
  static_assert(PolicyCheck<P>::kChecked);
  static_assert(
      IntersectionFilter<Filter, typename P::Real>,
      "hiprt: a filter needs FilterResult operator()(ray, hit) const for the rays' Real, or three parameters; see "
      "concept IntersectionFilter");
  static_assert(PrimitiveSet<Primitives, typename P::Real>,
                "hiprt: custom primitives must be a PrimitiveList, a TableRow or SceneShapes for the rays' Real; see "
                "concept PrimitiveSet");
  static constexpr bool kChecked = true;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
