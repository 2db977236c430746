#pragma once
/// One coordinate of a moving point, and its range over all times, in double.
///
/// Along each axis the coordinate of a point is a linear function of s, plus linear functions times the sine and the
/// cosine of the rotation's angle. If a bound of the second derivative allows an extremum, the interval of s is
/// halved.

#include <hiprt_build/format/short_stack.h>
#include <hiprt_device/math/affine.h>

#include <cmath>
#include <limits>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Both ends of a coordinate's range.
struct MotionRange {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
};

/// One coordinate of a point between two keys: e(s) + g(s) cos(2 phi(s)) + h(s) sin(2 phi(s)).
///
/// e, g and h are linear; phi is the angle of the arc between the quaternions.
struct MotionCurve {
  double e[2], g[2], h[2];  ///< The value at s = 0, and the difference at s = 1.
  double angle;             ///< phi(1), in [0, pi / 2].
  bool normalised;          ///< phi(s) = atan(s sin(angle), 1 - s + s cos(angle)); otherwise s * angle.

  struct Point {
    double value, derivative;
  };
  HIPRT_HD HIPRT_COLD Point at(double s) const {
    double phi = s * angle, speed = angle;
    if (normalised) {
      const double across = s * ::sin(angle), along = 1.0 - s + s * ::cos(angle);
      phi = ::atan2(across, along);
      speed = ::sin(angle) / (across * across + along * along);
    }
    const double cosine = ::cos(2.0 * phi), sine = ::sin(2.0 * phi);
    const double gs = g[0] + s * g[1], hs = h[0] + s * h[1];
    return {e[0] + s * e[1] + gs * cosine + hs * sine,
            e[1] + g[1] * cosine + h[1] * sine + 2.0 * speed * (hs * cosine - gs * sine)};
  }
  /// The least squared length of the quaternion before it is normalised.
  HIPRT_HD double least() const { return 0.5 * (1.0 + ::cos(angle)); }
  /// An upper bound of phi's derivative.
  HIPRT_HD double turning() const { return normalised ? ::sin(angle) / least() : angle; }
  HIPRT_HD double amplitude() const {
    return affine_detail::larger(::hypot(g[0], h[0]), ::hypot(g[0] + g[1], h[0] + h[1]));
  }
  /// An upper bound of the derivative.
  HIPRT_HD double speed() const { return ::fabs(e[1]) + ::hypot(g[1], h[1]) + 2.0 * turning() * amplitude(); }
  /// An upper bound of the second derivative.
  HIPRT_HD HIPRT_COLD double curvature() const {
    const double acceleration = normalised ? 2.0 * ::sin(angle) * (1.0 - ::cos(angle)) / (least() * least()) : 0.0;
    return 4.0 * turning() * ::hypot(g[1], h[1]) + amplitude() * (4.0 * turning() * turning() + 2.0 * acceleration);
  }
  HIPRT_HD double magnitude() const {
    double sum = 0.0;
    for (const double* pair : {e, g, h}) sum += ::fabs(pair[0]) + ::fabs(pair[1]);
    return sum;
  }

  /// The curve relative to a plane that has itself drifted by @p begin at s = 0 and by @p end at s = 1, linearly.
  HIPRT_HD MotionCurve drifting(double begin, double end) const {
    MotionCurve curve = *this;
    curve.e[0] -= begin;
    curve.e[1] -= end - begin;
    return curve;
  }
  /// Grows the range by the value at s, relative to a plane that has drifted by @p gone.
  /// @param slack as that of grow().
  HIPRT_HD void grow_at(MotionRange& range, double s, double gone, double slack) const {
    const double pad = slack * 0x1p-46 * (magnitude() + ::fabs(gone)), value = at(s).value - gone;
    range.low = affine_detail::smaller(range.low, value - pad);
    range.high = affine_detail::larger(range.high, value + pad);
  }
  /// Grows the range by all values for s in [0, 1].
  /// @param slack 1: the range is not too small. 0: it is not too large, and too small by at most 2^-26 of the
  /// magnitude.
  HIPRT_HD HIPRT_COLD void grow(MotionRange& range, double slack) const {
    const double pad = slack * 0x1p-46 * magnitude(), tolerance = 0x1p-26 * magnitude(), bend = curvature();
    const double first = at(0.0).value, last = at(1.0).value;
    const auto add = [&](double value, double beyond) {
      range.low = affine_detail::smaller(range.low, value - beyond - pad);
      range.high = affine_detail::larger(range.high, value + beyond + pad);
    };
    add(first, 0.0);
    add(last, 0.0);
    struct Interval {
      double begin, end, first, last;
    };
    // The halves end at a width of 2^-15: bend is at most 40 times the magnitude.
    format_detail::ShortStack<Interval, 24> pending;
    pending.push_back({0.0, 1.0, first, last});
    while (!pending.empty()) {
      const Interval part = pending.back();
      pending.pop_back();
      const double width = part.end - part.begin, beyond = bend * width * width / 8.0;
      const double low = affine_detail::smaller(part.first, part.last),
                   high = affine_detail::larger(part.first, part.last);
      if (low - beyond - pad >= range.low && high + beyond + pad <= range.high) continue;
      const double middle = part.begin + 0.5 * width;
      const Point center = at(middle);
      if (::fabs(center.derivative) > 0.5 * bend * width * (1.0 + 0x1p-40)) continue;
      add(center.value, 0.0);
      // Also ends if a number of the curve is not finite.
      if (!(beyond > tolerance)) {
        add(low, slack * beyond);
        add(high, slack * beyond);
        continue;
      }
      pending.push_back({middle, part.end, center.value, part.last});
      pending.push_back({part.begin, middle, part.first, center.value});
    }
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
