#pragma once
/// Error bound of a hit's t.

#include <hiprt_device/instances/levels.h>
#include <hiprt_device/intersect/box_test.h>
#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// A bound of the error of t of a triangle's hit.
///
/// The exact t is where the ray's line passes through the triangle's plane, as the files' records have it. The bound
/// is Hit::error over the cosine. It is computed from the hit when this function is called. It is +inf for a ray that
/// may lie in the plane, and for a triangle without area.
///
/// Let P be the point of the ray and Q the nearest point of the triangle: |(P - Q) . n| <= error |n|_1, and t moves P
/// by d . n. The error of the normal is at most 2^-24 (8 C + 4) of its length, where C is the scene's condition
/// (docs/proofs/instances.md).
/// @param scene that the ray was traced in.
/// @param hit of closest or all hits, found, with P::kSurface.
template <class Real>
HIPRT_HD inline Real t_error(const SceneView& scene, const BasicRay<Real>& ray, const BasicHit<Real>& hit) {
  const Real largest = max_component(hit.normal), length = max_component(ray.direction);
  if (!(largest > Real(0))) return std::numeric_limits<Real>::infinity();
  // Lengths are about 1, so no sum of squares leaves the range of floats.
  const BasicVec3<Real> n = divided(BasicVec3<Real>(hit.normal), largest), d = divided(ray.direction, length);
  const auto dot = [](const BasicVec3<Real>& a, const BasicVec3<Real>& b) {
    return fused_multiply_add(a.x, b.x, fused_multiply_add(a.y, b.y, a.z * b.z));
  };
  const Real sum = absolute(n.x) + absolute(n.y) + absolute(n.z);
  const Real reach = absolute(d.x) + absolute(d.y) + absolute(d.z);
  constexpr Real kUnit = 0x1p-24f;
  const Real turned = kUnit * (Real(14) * scene.condition + Real(8));
  // Euclidean lengths are at most these sums.
  const Real cosine = fused_multiply_add(-turned * sum, reach, absolute(dot(n, d)));
  if (!(cosine > Real(0))) return std::numeric_limits<Real>::infinity();
  return divided(divided(Real(hit.error) * sum * (Real(1) + Real(4) * turned), cosine), length);
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
