#pragma once
/// Decides exactly where a line crosses a round cone: the convex hull of two balls. (A ball is a round cone whose
/// second ball is inside the first.) Host only; every decision is in integers.
///
/// With y = o + t d - p0, w = p1 - p0, dr = r1 - r0, k = |w|^2 - dr^2 and N(t) = y.w + r0 dr, a point is in the solid
/// iff
///     N <= 0      and  |y|^2 <= r0^2,                       or
///     0 <= N <= k and  k (|y|^2 - r0^2) <= N^2,             or
///     N >= k      and  |y - w|^2 <= r1^2;
/// for k <= 0, iff it is in the larger ball. All three are quadratic in t with integer coefficients. So a crossing is a
/// root of one of them whose N is in the right range. Root and range are decided without rounding.

#include <hiprt_device/ray.h>
#include <tests/oracle/exact.h>

#include <optional>
#include <vector>

namespace hiprt::oracle {

/// A line and two balls. Doubles, so that tests can change radii by less than a float's spacing.
struct LineAndBalls {
  std::array<double, 3> origin, direction, p0, p1;
  double r0, r1;
};

/// A root (-b + sign * sqrt(d)) / a of a t^2 + 2 b t + c, with d = b^2 - a c >= 0; -c / (2 b) for a = 0.
class Root {
 public:
  Root(Integer a, Integer b, const Integer& c, int sign) : a_(std::move(a)), b_(std::move(b)), sign_(sign) {
    if (sgn(a_) == 0) {  // As a quotient: (-c + 0) / (2 b).
      a_ = 2 * b_;
      b_ = c;
      d_ = 0;
    } else {
      d_ = b_ * b_ - a_ * c;
    }
  }

  /// @return the sign of (root - numerator / denominator). @pre denominator != 0
  int compare(const Integer& numerator, const Integer& denominator) const {
    // Times a * denominator: x + y * sqrt(d).
    const Integer x = -(b_ * denominator) - a_ * numerator, y = sign_ * denominator;
    const int scale = sgn(a_) * sgn(denominator), sx = sgn(x), sy = sgn(y) * sgn(d_);
    if (sx == 0 || sy == 0 || sx == sy) return scale * (sx != 0 ? sx : sy);
    return scale * sx * sgn(Integer(x * x - y * y * d_));
  }

  /// @return the root with a relative error below 2^-150.
  Rational value() const {
    for (unsigned bits = 256;; bits *= 2) {
      Integer root;
      const Integer shifted = d_ << (2 * bits);
      mpz_sqrt(root.get_mpz_t(), shifted.get_mpz_t());
      const Integer numerator = -(b_ << bits) + sign_ * root;
      // The numerator is off by less than 1.
      const bool exact_root = root * root == shifted;
      if (!exact_root && mpz_sizeinbase(numerator.get_mpz_t(), 2) < 152) continue;
      return quotient(numerator, a_ << bits);
    }
  }

 private:
  Integer a_, b_, d_;
  int sign_;
};

/// Parameters of the crossings, with relative errors below 2^-150.
struct LineCrossings {
  Rational enter, exit;
};

namespace detail {

/// A quadratic a t^2 + 2 b t + c.
struct Quadratic {
  Integer a, b, c;

  void add_roots(std::vector<Root>& roots) const {
    if (sgn(a) == 0 && sgn(b) == 0) return;
    if (b * b - a * c < 0) return;
    roots.emplace_back(a, b, c, -1);
    roots.emplace_back(a, b, c, 1);
  }
};

/// The inputs as integers of one common unit.
struct IntegerCone {
  Integer3 o, d, w;
  Integer r0, r1, dr, k;

  explicit IntegerCone(const LineAndBalls& in) {
    int shift = 0;
    const auto see = [&](double v) {
      if (v != 0.0) shift = std::max(shift, 52 - std::ilogb(v));
    };
    for (const auto* vector : {&in.origin, &in.direction, &in.p0, &in.p1})
      for (const double v : *vector) see(v);
    see(in.r0), see(in.r1);
    const auto lift = [&](double v) {
      int exponent = 0;
      const Integer mantissa(std::ldexp(std::frexp(v, &exponent), 53));
      const int left = shift + exponent - 53;
      return left >= 0 ? Integer(mantissa << static_cast<unsigned>(left))
                       : Integer(mantissa >> static_cast<unsigned>(-left));  // Zeros only.
    };
    const auto lift3 = [&](const std::array<double, 3>& v) { return Integer3{lift(v[0]), lift(v[1]), lift(v[2])}; };
    const Integer3 p0 = lift3(in.p0);
    o = difference(lift3(in.origin), p0);
    d = lift3(in.direction);
    w = difference(lift3(in.p1), p0);
    r0 = lift(in.r0);
    r1 = lift(in.r1);
    dr = r1 - r0;
    k = dot(w, w) - dr * dr;
  }

  /// |y|^2 - radius^2 for y from a center at s * w, s = 0 or 1.
  Quadratic ball(int s) const {
    const Integer3 y = s == 0 ? o : difference(o, w);
    const Integer& r = s == 0 ? r0 : r1;
    return {dot(d, d), dot(y, d), dot(y, y) - r * r};
  }
};

}  // namespace detail

/// @return where the line crosses the solid's surface, or nothing. @pre finite, direction != 0, radii >= 0
inline std::optional<LineCrossings> cross_exactly(const LineAndBalls& in) {
  using namespace detail;
  if (in.r0 == 0.0 && in.r1 == 0.0) return {};
  const IntegerCone cone(in);
  std::vector<Root> found;
  if (sgn(cone.k) <= 0) {
    cone.ball(in.r1 > in.r0 ? 1 : 0).add_roots(found);
  } else {
    const Integer n = dot(cone.o, cone.w) + cone.r0 * cone.dr, slope = dot(cone.d, cone.w);
    // The sign of N - level at a root.
    const auto side = [&](const Root& root, const Integer& level) {
      const Integer gap = n - level;
      return sgn(slope) == 0 ? sgn(gap) : sgn(slope) * root.compare(-gap, slope);
    };
    const auto add = [&](const Quadratic& form, const auto& belongs) {
      std::vector<Root> roots;
      form.add_roots(roots);
      for (const Root& root : roots)
        if (belongs(side(root, 0), side(root, cone.k))) found.push_back(root);
    };
    const Quadratic ball = cone.ball(0);
    const Quadratic body{cone.k * ball.a - slope * slope, cone.k * ball.b - n * slope, cone.k * ball.c - n * n};
    add(ball, [](int first, int) { return first <= 0; });
    add(body, [](int first, int last) { return first >= 0 && last <= 0; });
    add(cone.ball(1), [](int, int last) { return last >= 0; });
  }
  if (found.empty()) return {};
  LineCrossings result{found[0].value(), found[0].value()};
  for (const Root& root : found) {
    const Rational value = root.value();
    result.enter = std::min(result.enter, value);
    result.exit = std::max(result.exit, value);
  }
  return result;
}

}  // namespace hiprt::oracle
