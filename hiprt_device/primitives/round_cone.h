#pragma once
/// The intersection of a line and a round cone: the convex hull of two balls.
///
/// The solid is the union of the balls with center p0 + s * w and radius r0 + s * dr for s in [0, 1], where w = p1 -
/// p0 and dr = r1 - r0. A point y (from p0) is in it iff the minimum over s of |y - s w|^2 - (r0 + s dr)^2 is <= 0.
/// That is a parabola in s with its minimum at s = (y.w + r0 dr) / k, k = |w|^2 - dr^2. For k <= 0 one ball contains
/// the other.
///
/// So planes across the axis (the seams, s = 0 and s = 1) divide space into three slabs, with a quadratic form of y in
/// each. The two balls are beyond the seams. Between them is the cone that touches both balls along the seams'
/// circles, with z = y.w / L, L = |w|, sigma = dr / L, c^2 = 1 - sigma^2:
///
///     c^2 |y x w / L|^2 - (r0 + sigma z)^2 <= 0
///
/// The solid is convex: a line enters and leaves it once. Whether the line crosses each seam inside the solid decides
/// which forms have its two crossings. Each of these decisions is made once, for both sides of the seam, and the
/// cone's crossings are confined to their slab. So there is no gap at a seam, and never a single crossing.
/// docs/proofs/round-shapes.md has the derivation and measurements.

#include <hiprt_device/primitives/line.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {
namespace primitive_detail {

/// One of the two balls, and the line's crossing of its seam's plane.
struct ConeEnd {
  Double3 center;
  double radius;
  Approach near;
  Double3 across;  ///< near.offset x w / L: its part across the axis, turned by 90 degrees.
  double beyond;   ///< Signed distance of near.offset from the seam's plane, along w.
};

/// A line and a round cone. Neither ball contains the other. The ends are ordered so that the line runs from the first
/// to the last, or across the axis.
struct ConeLine {
  Double3 origin, direction, w;
  bool flipped;  ///< The first end is the segment's second.
  ConeEnd first, last;
  double inverse;         ///< 1 / |direction|^2
  double inverse_length;  ///< 1 / L
  double length;          ///< L
  double sigma, c, c_squared;
  double slab;     ///< Distance of the seams' planes: c^2 L.
  double climb;    ///< Component of the direction along the axis: >= 0.
  Double3 across;  ///< direction x w / L

  /// @pre k > 0, direction.w >= 0 for w = last - first
  HIPRT_HD HIPRT_FORCE_INLINE void prepare(double k) {
    const double squared = dot(w, w);
    length = square_root(squared);
    inverse_length = 1.0 / length;
    sigma = (last.radius - first.radius) * inverse_length;
    slab = k * inverse_length;
    c_squared = slab * inverse_length;
    c = square_root(c_squared);
    climb = dot(direction, w) * inverse_length;
    across = scaled(inverse_length, cross(direction, w));
    inverse = 1.0 / dot(direction, direction);
    prepare(first);
    prepare(last);
  }

  /// Whether the line crosses the plane of the end's seam inside the solid. There the solid is a disk of radius c *
  /// radius.
  HIPRT_HD HIPRT_FORCE_INLINE bool is_inside_seam(const ConeEnd& end) const {
    // across + t * this->across at t = -beyond / climb, times climb.
    const Double3 at{fused_multiply_add(climb, end.across.x, -(end.beyond * across.x)),
                     fused_multiply_add(climb, end.across.y, -(end.beyond * across.y)),
                     fused_multiply_add(climb, end.across.z, -(end.beyond * across.z))};
    const double limit = end.radius * c * climb;
    return dot(at, at) < limit * limit;
  }

  HIPRT_HD HIPRT_FORCE_INLINE double seam(const ConeEnd& end) const {
    return end.near.t + (end.near.rest - end.beyond / climb);
  }

 private:
  HIPRT_HD HIPRT_FORCE_INLINE void prepare(ConeEnd& end) const {
    end.near = approach(origin - end.center, direction, inverse, end.radius);
    end.across = scaled(inverse_length, cross(end.near.offset, w));
    end.beyond = fused_multiply_add(end.radius, sigma, dot(end.near.offset, w) * inverse_length);
  }
};

/// Two crossings with the cone between the seams.
///
/// They are parameters relative to a point of the line that is in the slab and near the axis. So no digits are lost to
/// the distance of the origin or the length of the cone.
struct ConeRoots {
  double at;           ///< Parameter of that point.
  Double3 offset;      ///< Its position relative to the first center.
  double enter, exit;  ///< Parameters minus at.
};

/// Returns low for NaN.
HIPRT_HD HIPRT_FORCE_INLINE double clamped(double a, double low, double high) {
  return a > low ? (a < high ? a : high) : low;
}

/// The cone's form along a line: a t^2 + 2 b t + constant, with t from a point of the line in the slab.
struct ConeForm {
  Double3 p, q;           ///< The part across the axis: p + t q, turned by 90 degrees.
  double z;               ///< The part along the axis, from the first center.
  double radius, growth;  ///< r0 + sigma z = radius + t * growth
  double a, b, constant;

  /// @param offset of the point from the first center.
  HIPRT_HD HIPRT_FORCE_INLINE ConeForm(const ConeLine& line, const Double3& offset)
      : p(scaled(line.inverse_length, cross(offset, line.w))),
        q(line.across),
        z(dot(offset, line.w) * line.inverse_length),
        radius(fused_multiply_add(line.sigma, z, line.first.radius)),
        growth(line.sigma * line.climb),
        a(difference_of_products(line.c_squared, dot(q, q), growth, growth)),
        b(difference_of_products(line.c_squared, dot(p, q), radius, growth)),
        constant(difference_of_products(line.c_squared, dot(p, p), radius, radius)) {}

  /// Whether the form of a line that is outside at both seams has a minimum between them that is not positive.
  ///
  /// The form is evaluated at the minimum. The sign of root()'s operand does not help for lines along the cone, where
  /// a and b cancel.
  HIPRT_HD HIPRT_FORCE_INLINE bool dips(const ConeLine& line) const {
    const double beyond_seam = fused_multiply_add(line.sigma, line.first.radius, z);
    const double lowest_beyond = fused_multiply_add(beyond_seam, a, -(line.climb * b));  // Times a.
    // A line in a seam's plane must not pass between ball and cone. It may count as crossing either.
    const double doubt = 0x1p-50 * (line.length + line.first.radius + line.last.radius);
    if (!(a > 0.0 && lowest_beyond >= -doubt * a && lowest_beyond <= fused_multiply_add(line.slab, a, doubt * a)))
      return false;
    const double lowest = -(b / a);
    const Double3 p_lowest = along(p, lowest, q);
    const double radius_lowest = fused_multiply_add(growth, lowest, radius);
    return line.c_squared * dot(p_lowest, p_lowest) <= radius_lowest * radius_lowest;
  }

  /// sqrt(b^2 - a * constant), as a difference of squares that cancels only for tangents (Lagrange's identity in the
  /// metric of the form). 0 where rounding makes it imaginary.
  HIPRT_HD HIPRT_FORCE_INLINE double root(const ConeLine& line) const {
    const Double3 v{difference_of_products(radius, q.x, growth, p.x), difference_of_products(radius, q.y, growth, p.y),
                    difference_of_products(radius, q.z, growth, p.z)};
    const Double3 pq = cross(p, q);
    const double square = fused_multiply_add(-line.c_squared, dot(pq, pq), dot(v, v));
    return multiplied(line.c, square_root(larger(square, 0.0)));
  }
};

/// Finds the crossings with the cone.
/// @param low, high parameters of the seams.
/// @param certain the seams tell that the line crosses the cone in the slab once. Otherwise it crosses twice or not at
/// all.
/// @return false if it does not cross.
HIPRT_HD inline bool cone_roots(const ConeLine& line, double low, double high, bool certain, ConeRoots& roots) {
  const ConeEnd& end = line.first;
  const double nearest = end.near.rest - dot(end.across, line.across) / dot(line.across, line.across);
  roots.at = clamped(end.near.t + nearest, low, high);
  roots.offset = along(line.origin - end.center, roots.at, line.direction);
  const ConeForm form(line, roots.offset);
  if (!certain && !form.dips(line)) return false;
  // No cancellation: one root as sum / a, the other as constant / sum.
  const double root = form.root(line);
  const double sum = form.b > 0.0 ? -(form.b + root) : root - form.b;
  const double one = sum / form.a;
  double other = sum == 0.0 ? 0.0 : form.constant / sum;
  // This is the smaller root. Where both are rounding errors (tangents), the quotient may be anything.
  if (magnitude(other) > magnitude(one)) other = other < 0.0 ? -magnitude(one) : magnitude(one);
  roots.enter = clamped(form.b > 0.0 ? one : other, low - roots.at, high - roots.at);
  roots.exit = clamped(form.b > 0.0 ? other : one, low - roots.at, high - roots.at);
  return true;
}

HIPRT_HD HIPRT_FORCE_INLINE double selected(bool first, double a, double b) { return first ? a : b; }
HIPRT_HD HIPRT_FORCE_INLINE Double3 selected(bool first, const Double3& a, const Double3& b) {
  return {first ? a.x : b.x, first ? a.y : b.y, first ? a.z : b.z};
}

/// A crossing of the surface: a step from a point of the line whose offset from a center of the axis is known.
struct ConeCrossing {
  double t;
  double step;
  Double3 offset;
  double radius;  ///< Radius of the ball.
  bool is_last;   ///< Whether it is the last ball.
  bool on_cone;   ///< Whether the crossing is on the cone. Then the offset is from the first center.

  HIPRT_HD HIPRT_FORCE_INLINE void set_ball(const ConeLine& line, bool last, bool exit) {
    const Approach &a = line.last.near, &b = line.first.near;
    // The line may miss the ball by a rounding error.
    const double half_chord = square_root(larger(selected(last, a.discriminant, b.discriminant), 0.0) * line.inverse);
    on_cone = false;
    is_last = last;
    radius = selected(last, line.last.radius, line.first.radius);
    step = exit ? half_chord : -half_chord;
    offset = selected(last, a.offset, b.offset);
    t = selected(last, a.t, b.t) + (selected(last, a.rest, b.rest) + step);
  }

  HIPRT_HD HIPRT_FORCE_INLINE void set_cone(const ConeRoots& roots, bool exit) {
    on_cone = true;
    is_last = false;
    radius = 0.0;
    step = exit ? roots.exit : roots.enter;
    offset = roots.offset;
    t = roots.at + step;
  }

  HIPRT_HD HIPRT_FORCE_INLINE Details details(const ConeLine& line) const {
    const Double3 axis = scaled(line.inverse_length, line.w), y = along(offset, step, line.direction);
    if (!on_cone) {
      const Double3 outward = is_last ? axis : -axis;
      return {radius > 0.0 ? scaled(1.0 / radius, y) : outward, is_last != line.flipped ? 1.0 : 0.0, 0.0};
    }
    // The normal is orthogonal to the axis even if only a rounding error is left of it, so it is always one of the
    // surface. At a tip it points along the axis.
    const Double3 across = cross(line.w, cross(y, line.w));
    const double distance = square_root(dot(across, across));
    Double3 normal = line.sigma > 0.0 ? -axis : axis;
    if (distance > 0.0) normal = along(scaled(-line.sigma, axis), line.c / distance, across);
    const double z = dot(y, line.w) * line.inverse_length;
    const double s = clamped(fused_multiply_add(line.first.radius, line.sigma, z) / line.slab, 0.0, 1.0);
    return {normal, line.flipped ? 1.0 - s : s, 0.0};
  }
};

/// Both crossings, in the order of the line.
struct ConeCrossings {
  ConeCrossing enter{}, exit{};

  /// @return false if the line misses.
  HIPRT_HD HIPRT_FORCE_INLINE bool find(const ConeLine& line) {
    const ConeEnd &first = line.first, &last = line.last;
    const bool through_first = line.is_inside_seam(first), through_last = line.is_inside_seam(last);
    const bool neither = !through_first && !through_last;
    const bool only_first = neither && first.near.discriminant >= 0.0 && first.beyond <= 0.0;
    const bool only_last = neither && !only_first && last.near.discriminant >= 0.0 && last.beyond >= 0.0;
    const bool enter_cone = !through_first && !only_first && !only_last;
    const bool exit_cone = !through_last && !only_first && !only_last;
    if (enter_cone || exit_cone) {
      constexpr double kInfinity = std::numeric_limits<double>::infinity();
      const double low = line.climb > 0.0 ? line.seam(first) : -kInfinity;
      const double high = line.climb > 0.0 ? line.seam(last) : kInfinity;
      ConeRoots roots;
      if (!cone_roots(line, low, high, !neither, roots)) return false;
      if (enter_cone) enter.set_cone(roots, false);
      if (exit_cone) exit.set_cone(roots, true);
    }
    if (!enter_cone) enter.set_ball(line, only_last, false);
    if (!exit_cone) exit.set_ball(line, !only_first, true);
    return true;
  }
};

}  // namespace primitive_detail
}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
