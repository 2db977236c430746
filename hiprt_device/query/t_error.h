#pragma once
/// How far a hit's t may be off.

#include <hiprt_device/instances/levels.h>
#include <hiprt_device/intersect/box_test.h>
#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// A bound of the distance between the t of a triangle's hit and where the ray's line, exactly, passes through the
/// triangle's plane (as the files' records have it): what Hit::error allows the point, over the cosine. Computed from
/// the hit when it is asked for. +inf for a ray that may lie in the plane, and for a triangle without area.
///
/// |(P - Q) . n| <= error |n|_1 for the point P of the ray and the nearest one Q of the triangle, and t moves P by d .
/// n. The normal is off by 2^-24 (8 C + 4) of its length at most, C the scene's condition (decision 0014).
/// @param scene that the ray was traced in. @param hit of closest or all hits, found, with P::kSurface.
template <class Real>
HIPRT_HD inline Real t_error(const SceneView& scene, const BasicRay<Real>& ray, const BasicHit<Real>& hit) {
  const Real largest = max_component(hit.normal), length = max_component(ray.direction);
  if (!(largest > Real(0))) return std::numeric_limits<Real>::infinity();
  // Lengths of about 1: no sum of squares leaves the range of floats.
  const BasicVec3<Real> n = divided(BasicVec3<Real>(hit.normal), largest), d = divided(ray.direction, length);
  const auto dot = [](const BasicVec3<Real>& a, const BasicVec3<Real>& b) {
    return fused_multiply_add(a.x, b.x, fused_multiply_add(a.y, b.y, a.z * b.z));
  };
  const Real sum = absolute(n.x) + absolute(n.y) + absolute(n.z);
  const Real reach = absolute(d.x) + absolute(d.y) + absolute(d.z);
  constexpr Real kUnit = 0x1p-24f;
  const Real turned = kUnit * (Real(8) * scene.condition + Real(8));
  // The Euclidean lengths are at most the sums.
  const Real cosine = fused_multiply_add(-turned * sum, reach, absolute(dot(n, d)));
  if (!(cosine > Real(0))) return std::numeric_limits<Real>::infinity();
  return divided(divided(Real(hit.error) * sum * (Real(1) + Real(4) * turned), cosine), length);
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
