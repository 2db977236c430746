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

/// A filter is called with t, u, v, geometry and primitive of a candidate.
///
/// The normal and the error bound of a triangle are not set then; those of a custom primitive are. A closest-hit
/// traversal calls the filter only for candidates that are nearer than its hit. How many those are depends on the
/// tree.
/// @tparam Real of the rays.
template <class T, class Real = float>
concept IntersectionFilter = requires(const T& filter, const BasicRay<Real>& ray, const BasicHit<Real>& hit) {
  { filter(ray, hit) } -> std::same_as<FilterResult>;
};

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

}  // namespace hiprt
