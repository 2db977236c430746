#pragma once
/// The origin of a ray that leaves a surface.

#include <hiprt_device/intersect/box_test.h>
#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace spawn_detail {

/// Has the same bits whether or not a compiler contracts multiplications and additions.
template <class Real>
HIPRT_HD HIPRT_FORCE_INLINE BasicVec3<Real> moved(const BasicVec3<Real>& from, Real distance,
                                                  const BasicVec3<Real>& direction) {
  return {fused_multiply_add(distance, direction.x, from.x), fused_multiply_add(distance, direction.y, from.y),
          fused_multiply_add(distance, direction.z, from.z)};
}

template <class Real> HIPRT_HD HIPRT_FORCE_INLINE Real dot(const BasicVec3<Real>& a, const BasicVec3<Real>& b) {
  return fused_multiply_add(a.x, b.x, fused_multiply_add(a.y, b.y, a.z * b.z));
}

}  // namespace spawn_detail

/// The hit point, moved off the triangle along its normal to the side of @p direction.
///
/// The point moves by no more than the hit's error bound requires (after Pharr, Jakob, Humphreys, PBR 4th ed., 6.8.6).
/// A ray from there with tmin = 0 does not hit the same triangle again (docs/proofs/where-a-hit-is.md). A triangle
/// without area has no normal: its point moves along @p direction. The ray may miss another surface that is nearer
/// than the error bound, such as the far wall of a sharp crease.
/// @param hit of closest_hit(), found.
/// @param direction of the new ray, any length but 0. In the plane of the triangle the point moves to the normal's
/// side.
template <class Real>
HIPRT_HD inline BasicVec3<Real> spawn_origin(const BasicRay<Real>& ray, const BasicHit<Real>& hit,
                                             const BasicVec3<Real>& direction) {
  using namespace spawn_detail;
  const BasicVec3<Real> point = moved(ray.origin, hit.t, ray.direction);
  const Real error = hit.error;
  const Real length = max_component(hit.normal);
  if (!(length > Real(0))) return moved(point, Real(2) * error, divided(direction, max_component(direction)));
  const BasicVec3<Real> n = divided(hit.normal, length);
  const Real squared = dot(n, n);
  // The box of half width error around the point reaches |n|_1 * error / |n| along the normal.
  const Real distance = divided(error * (absolute(n.x) + absolute(n.y) + absolute(n.z)), squared);
  const bool along = dot(n, direction) >= Real(0);
  return moved(point, along ? distance : -distance, n);
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
