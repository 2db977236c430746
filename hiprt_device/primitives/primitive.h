#pragma once
/// What a custom primitive tells the traversal. Ready-made ones: primitives/sphere.h, primitives/round_curve.h,
/// primitives/moving_triangle.h, primitives/double_triangle.h.

#include <hiprt_device/math/vec.h>

namespace hiprt {

/// A crossing of a ray with the surface of a custom primitive.
template <class Real> struct BasicCustomHit {
  Real t;                  ///< In units of the direction, as Ray::tmin and Ray::tmax.
  Real u, v;               ///< Two surface parameters; what they mean is the primitive's.
  BasicVec3<Real> normal;  ///< Outward geometric normal: any length but 0.
  /// Bound, in scene units and per axis, of the distance between the computed point origin + t * direction and the true
  /// surface, with room for the rounding of a ray that starts there (spawn.h), as Hit::error.
  float error;
};
using CustomHit = BasicCustomHit<float>;
using CustomHitD = BasicCustomHit<double>;

}  // namespace hiprt
