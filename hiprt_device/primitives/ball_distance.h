#pragma once
/// The point of a ball's surface that is closest to a point, in double.

#include <hiprt_device/primitives/custom_point.h>
#include <hiprt_device/primitives/line.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {
namespace primitive_detail {

HIPRT_HD HIPRT_FORCE_INLINE Vec3D to_vec(const Double3& a) { return {a.x, a.y, a.z}; }

/// A point, seen from the center of a ball.
struct FromCenter {
  Double3 center, y;  ///< y: the point minus the center.
  double radius, length;

  HIPRT_HD HIPRT_FORCE_INLINE FromCenter(const Vec3D& point, const float (&at)[3], float radius_of_ball)
      : center(widen(at)), y(widen(point) - center), radius(radius_of_ball), length(square_root(dot(y, y))) {}

  /// Negative inside. The difference of the squares does not cancel near the surface.
  HIPRT_HD HIPRT_FORCE_INLINE double distance() const {
    return length > 0.0 ? squares_difference(y, radius) / (length + radius) : -radius;
  }
  /// @param outward of any length: the direction for a point at the center.
  /// @param normal of the surface there, of any length.
  HIPRT_HD HIPRT_FORCE_INLINE CustomPoint closest(const Double3& outward, Double3& normal) const {
    const bool is_center = !(length > 0.0);
    normal = is_center ? outward : y;
    const double size = is_center ? square_root(dot(outward, outward)) : length, away = distance();
    CustomPoint result;
    result.squared = away * away;
    result.point = to_vec(along(center, radius / size, normal));
    return result;
  }
};

/// The closest point of a ball's surface.
HIPRT_HD HIPRT_FORCE_INLINE CustomPoint closest_on_ball(const Vec3D& point, const float (&center)[3], float radius,
                                                        const Double3& outward, Double3& normal) {
  return FromCenter(point, center, radius).closest(outward, normal);
}

}  // namespace primitive_detail
}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
