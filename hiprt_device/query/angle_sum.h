#pragma once
/// The sum of the solid angles of triangles, in turns, with a bound of its rounding.
///
/// Van Oosterom and Strackee, "The Solid Angle of a Plane Triangle" (1983): half of the angle is the argument of a
/// complex number. The numbers are multiplied, and full turns are counted. So one arc tangent is enough for all
/// triangles. The sum of a closed mesh is a whole number within rounding. Every machine gives the same bits.

#include <hiprt_device/math/vec.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace angle_detail {

/// Errors in turns: of a half angle, as a share of the product of the lengths over the complex number's size; and of
/// one multiplication. docs/proofs/winding-numbers.md: Rounding.
inline constexpr double kAngleRounding = 0x1p-48, kProductRounding = 0x1p-52;

HIPRT_HD HIPRT_FORCE_INLINE double sum_of_products(const Vec3D& a, const Vec3D& b) {
  return fused_multiply_add(a.x, b.x, fused_multiply_add(a.y, b.y, a.z * b.z));
}
HIPRT_HD HIPRT_FORCE_INLINE double determinant(const Vec3D& a, const Vec3D& b, const Vec3D& c) {
  const Vec3D cross(difference_of_products(b.y, c.z, b.z, c.y), difference_of_products(b.z, c.x, b.x, c.z),
                    difference_of_products(b.x, c.y, b.y, c.x));
  return sum_of_products(a, cross);
}

/// The argument of a complex number of the first quadrant, in eighths of a radian: 0 to pi / 16.
///
/// Three halvings of the angle by square roots. Then the series of the arc tangent is short.
HIPRT_HD inline double eighth_of_argument(double x, double y) {
  for (unsigned i = 0; i < 3; ++i) {
    const double size = max_of(x, y);
    x = divided(x, size);
    y = divided(y, size);
    x += square_root(fused_multiply_add(x, x, y * y));
  }
  const double t = divided(y, x), squared = t * t;
  double sum = 0.0;
  for (unsigned n = 23; n > 1; n -= 2) sum = fused_multiply_add(sum, squared, divided(n % 4 == 1 ? 1.0 : -1.0, n));
  return fused_multiply_add(t * squared, sum, t);
}

}  // namespace angle_detail

class AngleSum {
 public:
  /// Adds a triangle, in any order of triangles. @param a, b, c from the point to its corners.
  HIPRT_HD inline void add(const Vec3D& a, const Vec3D& b, const Vec3D& c) {
    using namespace angle_detail;
    const double la = square_root(sum_of_products(a, a)), lb = square_root(sum_of_products(b, b)),
                 lc = square_root(sum_of_products(c, c));
    const double lengths = la * lb * lc, y = determinant(a, b, c);
    const double x = fused_multiply_add(
        sum_of_products(a, b), lc,
        fused_multiply_add(sum_of_products(b, c), la, fused_multiply_add(sum_of_products(c, a), lb, lengths)));
    const double size = max_of(absolute(x), absolute(y)), share = kAngleRounding * lengths;
    // Beside the surface it may be unknown on which side the point is: that is a full turn.
    if (!(size > share) || (x < 0.0 && absolute(y) <= share)) {
      error_ += 1.0;
      if (!(size > 0.0)) return;
    } else {
      error_ += divided(share, size) + kProductRounding;
    }
    multiply(divided(x, size), divided(y, size));
  }

  /// The sum of the solid angles over 4 pi.
  HIPRT_HD inline double turns() const {
    constexpr double kTurns = 1.2732395447351628;  // 8 / (2 pi)
    const bool left = re_ < 0.0, below = im_ < 0.0;
    const double whole = static_cast<double>(full_) + (left ? (below ? -0.5 : 0.5) : 0.0);
    return fused_multiply_add(angle_detail::eighth_of_argument(absolute(re_), absolute(im_)),
                              left != below ? -kTurns : kTurns, whole);
  }
  HIPRT_HD inline double error() const { return error_ + 0x1p-50; }

 private:
  /// The product is kept below 2^65: each factor's size is between 1 and the root of 2.
  HIPRT_HD inline void multiply(double x, double y) {
    const double re = difference_of_products(re_, x, im_, y), im = fused_multiply_add(re_, y, im_ * x);
    // Arguments are above -1/2 turn, and at most 1/2 turn.
    const bool up = !(im_ < 0.0), up_too = !(y < 0.0), sum_up = !(im < 0.0);
    if (up && up_too && !sum_up) ++full_;
    if (!up && !up_too && sum_up) --full_;
    const double scale = max_of(absolute(re), absolute(im)) > 0x1p64 ? 0x1p-64 : 1.0;
    re_ = re * scale;
    im_ = im * scale;
  }

  double re_ = 1.0, im_ = 0.0, error_ = 0.0;
  std::int32_t full_ = 0;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
