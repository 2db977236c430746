#pragma once
/// Where to start a ray that leaves a surface.

#include <hiprt_device/box_test.h>
#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace spawn_detail {

/// The same bits whatever a compiler contracts.
HIPRT_HD HIPRT_INLINE Vec3 moved(const Vec3& from, float distance, const Vec3& direction) {
  return {fused_multiply_add(distance, direction.x, from.x), fused_multiply_add(distance, direction.y, from.y),
          fused_multiply_add(distance, direction.z, from.z)};
}

HIPRT_HD HIPRT_INLINE float dot(const Vec3& a, const Vec3& b) {
  return fused_multiply_add(a.x, b.x, fused_multiply_add(a.y, b.y, a.z * b.z));
}

}  // namespace spawn_detail

/// The hit point, moved off the triangle along its normal to the side that @p direction points to, by no more than the
/// hit's own error bound demands (after Pharr, Jakob, Humphreys, PBR 4th ed., 6.8.6): a ray from there with tmin = 0
/// does not meet the same triangle again. A triangle without area has no normal: the point is moved along @p direction.
/// Other surfaces that are nearer than the error bound (the far wall of a sharp crease) may be passed.
/// @param hit of closest_hit(), found.
/// @param direction of the new ray, any length but 0.
HIPRT_HD inline Vec3 spawn_origin(const Ray& ray, const Hit& hit, const Vec3& direction) {
  using namespace spawn_detail;
  const Vec3 point = moved(ray.origin, hit.t, ray.direction);
  const float length = max_component(hit.normal);
  if (!(length > 0.0f)) return moved(point, 2.0f * hit.error, divided(direction, max_component(direction)));
  const Vec3 n = divided(hit.normal, length);
  const float squared = dot(n, n);
  // The box of half width error around the point reaches |n|_1 * error / |n| along the normal.
  const float distance = divided(hit.error * (absolute(n.x) + absolute(n.y) + absolute(n.z)), squared);
  const bool along = dot(n, direction) >= 0.0f;
  return moved(point, along ? distance : -distance, n);
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
