#pragma once
/// The hit that a custom primitive reports to the traversal.
///
/// Ready-made primitives: primitives/sphere.h, primitives/round_curve.h, primitives/moving_triangle.h,
/// primitives/double_triangle.h.

#include <hiprt_device/math/vec.h>

namespace hiprt {

/// A crossing of a ray with the surface of a custom primitive.
template <class Real> struct BasicCustomHit {
  Real t;                  ///< In units of the direction, as Ray::tmin and Ray::tmax.
  Real u, v;               ///< Two surface parameters; the primitive defines their meaning.
  BasicVec3<Real> normal;  ///< Outward geometric normal: any length but 0.
  /// Bound, in scene units and per axis, of the distance between the computed point origin + t * direction and the
  /// surface. As Hit::error, it includes the rounding of a ray that starts there (spawn.h).
  float error;
};
using CustomHit = BasicCustomHit<float>;
using CustomHitD = BasicCustomHit<double>;

}  // namespace hiprt
