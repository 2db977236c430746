#pragma once
/// Spheres as custom primitives.

#include <hiprt_device/primitives/ball_distance.h>

namespace hiprt {

/// A sphere. It is never hit if it is not finite, or if its radius is not positive.
struct Sphere {
  float center[3];
  float radius;
};
static_assert(sizeof(Sphere) == 16);

inline namespace HIPRT_ISA_NAMESPACE {
namespace primitive_detail {

HIPRT_HD HIPRT_FORCE_INLINE bool is_valid(const Sphere& sphere) {
  return is_finite(sphere.center) && sphere.radius > 0.0f && is_finite(sphere.radius);
}

/// Sets u and v from the normal, of any length: octahedral coordinates, both in [0, 1] (Meyer et al. 2010).
HIPRT_HD HIPRT_FORCE_INLINE void set_octahedral(Details& details) {
  const Double3& n = details.normal;
  const double sum = magnitude(n.x) + magnitude(n.y) + magnitude(n.z);
  double x = n.x / sum, y = n.y / sum;
  if (n.z < 0.0) {
    const double folded_x = 1.0 - magnitude(y), folded_y = 1.0 - magnitude(x);
    x = x < 0.0 ? -folded_x : folded_x;
    y = y < 0.0 ? -folded_y : folded_y;
  }
  details.u = fused_multiply_add(0.5, x, 0.5);
  details.v = fused_multiply_add(0.5, y, 0.5);
}

}  // namespace primitive_detail

/// The payload of a geometry of spheres.
///
/// Both crossings of a line are reported, the entry first. A line that touches the sphere in one point crosses it
/// twice there, at the same t.
///
/// Accuracy (docs/proofs/round-shapes.md): hits and misses are those of a line that is displaced by at most 2^-50
/// radii. The difference of origin and center may be inexact in double (exponents more than 29 apart). Then the
/// displacement grows by 2^-52 of their distance. The error of t is at most half a unit in the last place plus 2^-49
/// radii over the cosine of the angle of incidence.
///
/// u, v: octahedral coordinates of the normal in [0, 1]^2, which need no trigonometry. The sphere is projected from
/// its center to the octahedron |x| + |y| + |z| = 1. Seen from above, the half z >= 0 fills the rotated square in the
/// middle, and the half z < 0 the four corners. The normal has length 1.
///
/// A point query gets the closest point of the surface, also from inside. From the center all are as close, and the
/// one in direction z counts. The distance is within 2^-50 of itself plus 2^-52 of the largest coordinate's magnitude.
struct SphereSet {
  const Sphere* spheres;

  /// Calls report(CustomHit) for each crossing of sphere @p primitive inside [tmin, tmax]. report returns false to
  /// stop.
  /// @return false if stopped.
  template <class Real, class Report>
  HIPRT_HD bool intersect(const BasicRay<Real>& ray, std::type_identity_t<Real> tmin, std::type_identity_t<Real> tmax,
                          std::uint32_t primitive, Report&& report) const {
    using namespace primitive_detail;
    const Sphere& sphere = spheres[primitive];
    if (!is_valid(sphere)) return true;
    return intersect_ball(
        ray, tmin, tmax, sphere.center, sphere.radius, [](Details& details) { set_octahedral(details); }, report);
  }

  /// The closest point of sphere @p primitive.
  HIPRT_HD CustomPoint closest(const PointInObject& at, std::uint32_t primitive) const {
    using namespace primitive_detail;
    const Sphere& sphere = spheres[primitive];
    if (!is_valid(sphere)) return {};
    Details details;
    CustomPoint result = closest_on_ball(at.point, sphere.center, sphere.radius, {0, 0, 1}, details.normal);
    set_octahedral(details);
    result.u = details.u;
    result.v = details.v;
    return result;
  }

  /// The smallest box of floats around the sphere; empty for a sphere that is never hit.
  HIPRT_HD static Box bounds(const Sphere& sphere) {
    using namespace primitive_detail;
    return is_valid(sphere) ? ball_bounds(sphere.center, sphere.radius) : empty_box();
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
