#pragma once
/// Intersection filters: a functor that sees every hit that would count, and decides.
///
///     struct CutOut {  // alpha from a texture
///       const Texture* texture;
///       HIPRT_HD hiprt::FilterResult operator()(const hiprt::Ray& ray, const hiprt::Hit& hit) const {
///         return texture->alpha(hit.primitive, hit.u, hit.v) < 0.5f ? hiprt::FilterResult::kReject
///                                                                   : hiprt::FilterResult::kAccept;
///       }
///     };
///
/// The functor's members are its payload: it is copied into the traversal, so what it changes it keeps behind pointers.

#include <hiprt_device/ray.h>

namespace hiprt {

enum class FilterResult {
  kAccept,
  kReject,         ///< As if the primitive were not there.
  kAcceptAndStop,  ///< The hit counts, and the traversal ends with it.
};

/// Called with t, u, v, geometry and primitive of the candidate (a triangle's normal and error bound are not there yet;
/// a custom primitive's are). A closest-hit traversal asks only about candidates that are nearer than what it has; how
/// many those are depends on the tree.
/// @tparam Real of the rays.
template <class T, class Real = float>
concept IntersectionFilter = requires(const T& filter, const BasicRay<Real>& ray, const BasicHit<Real>& hit) {
  { filter(ray, hit) } -> std::same_as<FilterResult>;
};

/// Every hit counts; costs nothing.
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

}  // namespace hiprt
