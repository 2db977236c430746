#pragma once
/// Rays in double precision.
///
///     using Far = hiprt::DoubleRays<>;
///     hiprt::RayD ray;
///     ray.origin = {6378137.25, 0.0, 12.001};
///     hiprt::HitD hit = hiprt::closest_hit<Far>(scene, ray);

#include <hiprt_device/intersect/double_triangle_test.h>
#include <hiprt_device/traverse/policies.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Policies for rays in double precision (RayD, HitD).
///
/// Differences from float geometry are exact. So t, u, v and the hit point have the rounding of double, however far
/// away the origin is. Boxes are tested in float, from a point of the ray near the scene. Instances transform rays in
/// double: Instanced<DoubleRays<>>.
///
/// Guarantees (docs/proofs/double-rays.md) need the following ranges. The largest coordinate of scene bounds is as in
/// ray.h. The largest coordinate of the origin is below 2^200. The largest direction component is in [2^-200, 2^200].
/// @tparam Base its triangle test is replaced by WatertightDouble.
template <class Base = Policies> struct DoubleRays : Base {
  static_assert(Base::kLevels == 0, "hiprt: DoubleRays must be inside Instanced: write Instanced<DoubleRays<...>>");
  using Real = double;
  using Triangle = WatertightDouble;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
