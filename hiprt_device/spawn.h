#pragma once
/// Where to start a ray that leaves a surface.

#include <hiprt_device/box_test.h>
#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The hit point, moved off the triangle along its normal to the side that @p direction points to, by no more than the
/// hit's own error bound demands (after Pharr, Jakob, Humphreys, PBR 4th ed., 6.8.6): a ray from there with tmin = 0
/// does not meet the same triangle again. A triangle without area has no normal: the point is moved along @p direction.
/// Other surfaces that are nearer than the error bound (the far wall of a sharp crease) may be passed.
/// @param hit of closest_hit(), found.
/// @param direction of the new ray, any length but 0.
HIPRT_HD inline Vec3 spawn_origin(const Ray& ray, const Hit& hit, const Vec3& direction) {
  const Vec3 point = ray.origin + hit.t * ray.direction;
  const Vec3 n = hit.normal / max_of(max_component(hit.normal), std::numeric_limits<float>::min());
  const float squared = n.x * n.x + n.y * n.y + n.z * n.z;
  if (!(squared > 0.0f)) return point + 2.0f * hit.error * (direction / max_component(direction));
  // The box of half width error around the point reaches |n|_1 * error / |n| along the normal.
  const float distance = hit.error * (absolute(n.x) + absolute(n.y) + absolute(n.z)) / squared;
  const bool along = n.x * direction.x + n.y * direction.y + n.z * direction.z >= 0.0f;
  return point + (along ? distance : -distance) * n;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
