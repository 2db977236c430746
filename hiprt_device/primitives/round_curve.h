#pragma once
/// Round linear curves as custom primitives: balls swept along straight segments, with a radius that changes linearly.

#include <hiprt_device/primitives/cone_distance.h>

namespace hiprt {

/// A point of a curve's axis.
using CurveVertex = ShapePoint;

inline namespace HIPRT_ISA_NAMESPACE {
namespace primitive_detail {

using shape_detail::is_valid;

/// Whether the ray's line certainly misses the infinite cylinder around the segment.
///
/// The test is in float, because double precision is slow on many GPUs, and rays miss most segments of hair whose
/// boxes they meet. In a case of doubt its result may depend on the compiler. The final hits do not.
template <class Real>
HIPRT_HD HIPRT_FORCE_INLINE bool certainly_misses(const BasicRay<Real>& ray, const CurveVertex& a,
                                                  const CurveVertex& b) {
  const Vec3 from(static_cast<float>(ray.origin.x - a.position[0]), static_cast<float>(ray.origin.y - a.position[1]),
                  static_cast<float>(ray.origin.z - a.position[2]));
  const Vec3 w(b.position[0] - a.position[0], b.position[1] - a.position[1], b.position[2] - a.position[2]);
  const Real scale = Real(1) / max_component(ray.direction);
  const Vec3 d(static_cast<float>(ray.direction.x * scale), static_cast<float>(ray.direction.y * scale),
               static_cast<float>(ray.direction.z * scale));
  const Vec3 n(d.y * w.z - d.z * w.y, d.z * w.x - d.x * w.z, d.x * w.y - d.y * w.x);
  const float volume = from.x * n.x + from.y * n.y + from.z * n.z;
  // |volume| / |n| is the distance of the line from the axis. The volume is a sum of six products of three factors,
  // each with an error of at most 11 * 2^-24. |n| <= 3 * width.
  const float radius = max_of(a.radius, b.radius), width = max_component(w);
  const float doubt = 0x1p-17f * max_component(from) * width;
  const float reach = radius * radius * (n.x * n.x + n.y * n.y + n.z * n.z) + doubt * (6.0f * radius * width + doubt);
  // Elsewhere, squares may leave the range of floats.
  const bool in_range = scale >= Real(0x1p-120f) && scale <= Real(0x1p120f) && absolute(volume) < 0x1p60f &&
                        radius > 0x1p-30f && radius < 0x1p30f && width < 0x1p30f;
  return in_range && volume * volume > max_of(1.0001f * reach, 0x1p-90f);
}

/// Makes the line and the cone. The cone's first end is the one that the line reaches first.
/// @pre is_valid(a, b), k > 0
template <class Real>
HIPRT_HD HIPRT_FORCE_INLINE void set_line(const BasicRay<Real>& ray, const CurveVertex& a, const CurveVertex& b,
                                          const Double3& w, double k, ConeLine& line) {
  line.origin = widen(ray.origin);
  line.direction = widen(ray.direction);
  line.flipped = dot(line.direction, w) < 0.0;
  line.w = line.flipped ? -w : w;
  const Double3 at_a = widen(a.position), at_b = widen(b.position);
  const double radius_a = a.radius, radius_b = b.radius;
  line.first.center = line.flipped ? at_b : at_a;
  line.last.center = line.flipped ? at_a : at_b;
  line.first.radius = line.flipped ? radius_b : radius_a;
  line.last.radius = line.flipped ? radius_a : radius_b;
  line.prepare(k);
}

/// Reports the crossings of a round cone.
/// @pre Neither of its balls contains the other.
template <class Real, class Report>
HIPRT_HD inline bool intersect_cone(const BasicRay<Real>& ray, Real tmin, Real tmax, const ConeLine& line,
                                    Report& report) {
  ConeCrossings crossings;
  if (!crossings.find(line)) return true;
  const double size = line.length + larger(line.first.radius, line.last.radius);
  const double enter = crossings.enter.t, exit = larger(enter, crossings.exit.t);
  return report_crossing(
             ray, tmin, tmax, enter, size, line.length, [&] { return crossings.enter.details(line); }, report) &&
         report_crossing(
             ray, tmin, tmax, exit, size, line.length, [&] { return crossings.exit.details(line); }, report);
}

}  // namespace primitive_detail

/// The payload of a geometry of round linear curve segments.
///
/// Primitive i is the convex hull of two balls, around vertices[first_vertex[i]] and the vertex behind it. The balls
/// cap its ends.
///
/// A segment with a value that is not finite, a negative radius, or two radii of 0 is never hit. With one radius of 0
/// it ends in a tip. If one ball contains the other, the segment is the larger ball.
///
/// Both crossings of a line with the closed surface are reported, the entry first. There are two or none, also through
/// the seams between cone and caps. A line that touches the surface in one point crosses it twice there. A line that
/// lies in the surface may cross it anywhere along the surface. Segments of one curve overlap at their joints;
/// crossings inside the neighbour are reported, too.
///
/// Accuracy (docs/proofs/round-shapes.md): the size is the distance of the centers plus the larger radius. Hits and
/// misses are those of a line that is displaced by at most 2^-50 sizes, plus 2^-52 of the distance of the origin as
/// for SphereSet. Except at tips, the error of t is at most half a unit in the last place plus 2^-49 sizes over the
/// cosine of the angle of incidence.
///
/// u: the ball of the sweep that touches the surface at the hit has its center at (1 - u) * p0 + u * p1. u is 0 or 1
/// on the caps. v: 0. The normal has length 1; at a tip it points along the axis.
///
/// A point query gets the closest point of the surface, also from inside. Of several as close ones, as from a point of
/// the axis, it is always the same. The distance is within 2^-48 of that of the segment's farthest point, plus 2^-52 of
/// the largest coordinate's magnitude.
struct RoundCurveSet {
  const CurveVertex* vertices;
  const std::uint32_t* first_vertex;

  /// Calls report(CustomHit) for each crossing of segment @p primitive inside [tmin, tmax]. report returns false to
  /// stop.
  /// @return false if stopped.
  template <class Real, class Report>
  HIPRT_HD bool intersect(const BasicRay<Real>& ray, std::type_identity_t<Real> tmin, std::type_identity_t<Real> tmax,
                          std::uint32_t primitive, Report&& report) const {
    using namespace primitive_detail;
    const CurveVertex* vertex = vertices + first_vertex[primitive];
    if (!is_valid(vertex[0], vertex[1]) || certainly_misses(ray, vertex[0], vertex[1])) return true;
    const CurveVertex &a = vertex[0], &b = vertex[1];
    const Double3 w = widen(b.position) - widen(a.position);
    const double k = squares_difference(w, static_cast<double>(b.radius) - static_cast<double>(a.radius));
    if (!(k > 0.0)) {
      const bool at_b = b.radius > a.radius;
      const float center[3] = {at_b ? b.position[0] : a.position[0], at_b ? b.position[1] : a.position[1],
                               at_b ? b.position[2] : a.position[2]};
      return intersect_ball(
          ray, tmin, tmax, center, at_b ? b.radius : a.radius,
          [at_b](Details& details) { details.u = at_b ? 1.0 : 0.0; }, report);
    }
    ConeLine line;
    set_line(ray, a, b, w, k, line);
    return intersect_cone(ray, tmin, tmax, line, report);
  }

  /// The closest point of segment @p primitive.
  HIPRT_HD CustomPoint closest(const PointInObject& at, std::uint32_t primitive) const {
    const CurveVertex* vertex = vertices + first_vertex[primitive];
    if (!primitive_detail::is_valid(vertex[0], vertex[1])) return {};
    return primitive_detail::closest_on_curve(at.point, vertex[0], vertex[1]);
  }

  /// The smallest box of floats around the segment; empty for a segment that is never hit.
  HIPRT_HD static Box bounds(const CurveVertex& a, const CurveVertex& b) { return curve_bounds(a, b); }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
