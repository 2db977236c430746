#pragma once
/// Intersection filters: functors that accept or reject each hit that would count.
///
///     struct CutOut {  // alpha from a texture
///       const Texture* texture;
///       HIPRT_HD hiprt::FilterResult operator()(const hiprt::Ray& ray, const hiprt::Hit& hit) const {
///         return texture->alpha(hit.primitive, hit.u, hit.v) < 0.5f ? hiprt::FilterResult::kReject
///                                                                   : hiprt::FilterResult::kAccept;
///       }
///     };
///
/// The functor's members are its payload. The functor is copied into the traversal, so it keeps what it changes behind
/// pointers.

#include <hiprt_device/ray.h>

namespace hiprt {

enum class FilterResult {
  kAccept,
  kReject,         ///< The hit does not count, as if the primitive were not there.
  kAcceptAndStop,  ///< The hit counts, and the traversal ends with it.
};

/// What a filter may ask about a hit, besides the hit itself: its third parameter, a template. The query has a class
/// like this one, which computes only what is asked. In scenes of instances it also has path(): the numbers of the
/// instances, the outermost first.
template <class Real> struct FilterQuestions {
  /// Whether the ray comes from the side where the triangle's corners are counter-clockwise: where the normal points.
  /// As exact as the triangle test's decision. In an instance it is the object's side, also if the instance mirrors it.
  /// For a custom primitive: whether the normal and the ray's direction point against each other.
  HIPRT_HD bool is_front() const;
  /// The geometry's type: build::TriangleMesh::type or build::CustomGeometry::type.
  HIPRT_HD std::uint32_t type() const;
  /// As Hit::normal of the query's result.
  HIPRT_HD BasicVec3<Real> normal() const;
  /// The ray as the object sees it. Its tmax is the t of the closest hit so far.
  HIPRT_HD BasicRay<Real> object_ray() const;
  HIPRT_HD std::uint32_t depth() const;  ///< Number of instances around the primitive.
  /// InstanceRecord::id. @param level less than depth(); 0: the outermost.
  HIPRT_HD std::uint32_t instance_id(unsigned level) const;
};

/// A filter is called with the ray and a candidate: its t, u, v, geometry and primitive. In scenes of instances the
/// candidate also has the path (PathHit), for a filter that is a template of it. A filter may have a third parameter;
/// see FilterQuestions.
///
/// The normal and the error bound of a triangle are not set in the candidate; those of a custom primitive are. A
/// closest-hit traversal calls the filter only for candidates that are nearer than its hit. How many those are depends
/// on the tree.
/// @tparam Real of the rays.
template <class T, class Real = float>
concept IntersectionFilter = requires(const T& filter, const BasicRay<Real>& ray, const BasicHit<Real>& hit) {
  { filter(ray, hit) } -> std::same_as<FilterResult>;
}
|| requires(const T& filter, const BasicRay<Real>& ray, const BasicHit<Real>& hit,
            const FilterQuestions<Real>& questions) {
  { filter(ray, hit, questions) } -> std::same_as<FilterResult>;
};

/// @return the filter's answer.
/// @param questions for a filter with three parameters.
template <class Filter, class RayType, class HitType, class Questions>
HIPRT_HD HIPRT_FORCE_INLINE FilterResult call_filter(const Filter& filter, const RayType& ray, const HitType& hit,
                                                     const Questions& questions) {
  if constexpr (requires { filter(ray, hit, questions); })
    return filter(ray, hit, questions);
  else
    return filter(ray, hit);
}

/// Accepts every hit, at no cost.
struct NoFilter {
  template <class Real> HIPRT_HD constexpr FilterResult operator()(const BasicRay<Real>&, const BasicHit<Real>&) const {
    return FilterResult::kAccept;
  }
};

/// Rejects one primitive, for rays that start on it.
struct ExceptPrimitive {
  std::uint32_t geometry = kInvalidId;
  std::uint32_t primitive = kInvalidId;
  template <class Real>
  HIPRT_HD constexpr FilterResult operator()(const BasicRay<Real>&, const BasicHit<Real>& hit) const {
    return hit.geometry == geometry && hit.primitive == primitive ? FilterResult::kReject : FilterResult::kAccept;
  }
};

/// Rejects triangles and custom primitives by the side that the ray comes from (FilterQuestions::is_front()).
///
/// With the tests Watertight, Reference and WatertightDouble a closed surface does not leak: where a ray enters it, one
/// of the triangles is a front.
struct CullFaces {
  bool front = false;  ///< Reject hits on fronts.
  bool back = true;    ///< Reject hits on backs.
  template <class RayType, class HitType, class Questions>
  HIPRT_HD constexpr FilterResult operator()(const RayType&, const HitType&, const Questions& questions) const {
    return (questions.is_front() ? front : back) ? FilterResult::kReject : FilterResult::kAccept;
  }
};
/// CullFaces with a choice at compile time.
struct CullBackFaces {
  template <class RayType, class HitType, class Questions>
  HIPRT_HD constexpr FilterResult operator()(const RayType&, const HitType&, const Questions& questions) const {
    return questions.is_front() ? FilterResult::kAccept : FilterResult::kReject;
  }
};
struct CullFrontFaces {
  template <class RayType, class HitType, class Questions>
  HIPRT_HD constexpr FilterResult operator()(const RayType&, const HitType&, const Questions& questions) const {
    return questions.is_front() ? FilterResult::kReject : FilterResult::kAccept;
  }
};

/// Two filters, one after the other. The second is not asked about what the first rejects.
///
///     hiprt::BothFilters filter{hiprt::CullBackFaces{}, CutOut{texture}};
template <class First, class Second> struct BothFilters {
  First first;
  Second second;
  template <class RayType, class HitType, class Questions>
  HIPRT_HD constexpr FilterResult operator()(const RayType& ray, const HitType& hit, const Questions& questions) const {
    const FilterResult one = call_filter(first, ray, hit, questions);
    if (one == FilterResult::kReject) return one;
    const FilterResult two = call_filter(second, ray, hit, questions);
    return two == FilterResult::kAccept ? one : two;
  }
};
template <class First, class Second> BothFilters(First, Second) -> BothFilters<First, Second>;

}  // namespace hiprt
