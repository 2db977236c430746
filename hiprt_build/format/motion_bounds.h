#pragma once
/// Bounds of moving instances over all times, in double. Host only.
///
/// Along each axis the coordinate of a point is a linear function of s, plus linear functions times the sine and the
/// cosine of the rotation's angle. If a bound of the second derivative allows an extremum, the interval of s is
/// halved.

#include <hiprt_device/format/motion.h>
#include <hiprt_device/math/affine.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

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
  Point at(double s) const {
    double phi = s * angle, speed = angle;
    if (normalised) {
      const double across = s * std::sin(angle), along = 1.0 - s + s * std::cos(angle);
      phi = std::atan2(across, along);
      speed = std::sin(angle) / (across * across + along * along);
    }
    const double cosine = std::cos(2.0 * phi), sine = std::sin(2.0 * phi);
    const double gs = g[0] + s * g[1], hs = h[0] + s * h[1];
    return {e[0] + s * e[1] + gs * cosine + hs * sine,
            e[1] + g[1] * cosine + h[1] * sine + 2.0 * speed * (hs * cosine - gs * sine)};
  }
  /// The least squared length of the quaternion before it is normalised.
  double least() const { return 0.5 * (1.0 + std::cos(angle)); }
  /// An upper bound of phi's derivative.
  double turning() const { return normalised ? std::sin(angle) / least() : angle; }
  double amplitude() const { return std::max(std::hypot(g[0], h[0]), std::hypot(g[0] + g[1], h[0] + h[1])); }
  /// An upper bound of the derivative.
  double speed() const { return std::fabs(e[1]) + std::hypot(g[1], h[1]) + 2.0 * turning() * amplitude(); }
  /// An upper bound of the second derivative.
  double curvature() const {
    const double acceleration =
        normalised ? 2.0 * std::sin(angle) * (1.0 - std::cos(angle)) / (least() * least()) : 0.0;
    return 4.0 * turning() * std::hypot(g[1], h[1]) + amplitude() * (4.0 * turning() * turning() + 2.0 * acceleration);
  }
  double magnitude() const {
    double sum = 0.0;
    for (const double* pair : {e, g, h}) sum += std::fabs(pair[0]) + std::fabs(pair[1]);
    return sum;
  }

  /// The curve relative to a plane that has itself drifted by @p begin at s = 0 and by @p end at s = 1, linearly.
  MotionCurve drifting(double begin, double end) const {
    MotionCurve curve = *this;
    curve.e[0] -= begin;
    curve.e[1] -= end - begin;
    return curve;
  }
  /// Grows the range by the value at s, relative to a plane that has drifted by @p gone.
  /// @param slack as that of grow().
  void grow_at(MotionRange& range, double s, double gone, double slack) const {
    const double pad = slack * 0x1p-46 * (magnitude() + std::fabs(gone)), value = at(s).value - gone;
    range.low = std::min(range.low, value - pad);
    range.high = std::max(range.high, value + pad);
  }
  /// Grows the range by all values for s in [0, 1].
  /// @param slack 1: the range is not too small. 0: it is not too large, and too small by at most 2^-26 of the
  /// magnitude.
  void grow(MotionRange& range, double slack) const {
    const double pad = slack * 0x1p-46 * magnitude(), tolerance = 0x1p-26 * magnitude(), bend = curvature();
    const double first = at(0.0).value, last = at(1.0).value;
    const auto add = [&](double value, double beyond) {
      range.low = std::min(range.low, value - beyond - pad);
      range.high = std::max(range.high, value + beyond + pad);
    };
    add(first, 0.0);
    add(last, 0.0);
    struct Interval {
      double begin, end, first, last;
    };
    std::vector<Interval> pending{{0.0, 1.0, first, last}};
    while (!pending.empty()) {
      const Interval part = pending.back();
      pending.pop_back();
      const double width = part.end - part.begin, beyond = bend * width * width / 8.0;
      const double low = std::min(part.first, part.last), high = std::max(part.first, part.last);
      if (low - beyond - pad >= range.low && high + beyond + pad <= range.high) continue;
      const double middle = part.begin + 0.5 * width;
      const Point center = at(middle);
      if (std::fabs(center.derivative) > 0.5 * bend * width * (1.0 + 0x1p-40)) continue;
      add(center.value, 0.0);
      if (beyond <= tolerance) {
        add(low, slack * beyond);
        add(high, slack * beyond);
        continue;
      }
      pending.push_back({middle, part.end, center.value, part.last});
      pending.push_back({part.begin, middle, part.first, center.value});
    }
  }
};

/// A segment of a motion, in double: the transform of at_time() without its rounding.
class SegmentMotion {
 public:
  SegmentMotion(const MotionSegment& segment, MotionKind kind) : normalised_(kind == MotionKind::kNlerp) {
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned k = 0; k < 2; ++k) translation_[k][r] = segment.translation[k][r];
    if (kind == MotionKind::kMatrix) {
      for (unsigned r = 0; r < 3; ++r) {
        still_[r][r] = 1.0;
        for (unsigned c = 0; c < 3; ++c)
          for (unsigned k = 0; k < 2; ++k) stretch_[k][r][c] = segment.linear[k][r][c];
      }
      return;
    }
    set_rotation(segment.turning);
    for (unsigned k = 0; k < 2; ++k) {
      const float(&from)[6] = segment.turning.stretch[k];
      for (unsigned r = 0; r < 3; ++r) stretch_[k][r][r] = from[r];
      stretch_[k][0][1] = from[3];
      stretch_[k][0][2] = from[4];
      stretch_[k][1][2] = from[5];
    }
  }

  /// The curve of coordinate @p r of a point of the object.
  MotionCurve curve(unsigned r, const double (&p)[3]) const {
    double from[3], more[3];
    for (unsigned k = 0; k < 3; ++k) {
      const auto row = [&](const double(&u)[3]) { return u[0] * p[0] + u[1] * p[1] + u[2] * p[2]; };
      from[k] = row(stretch_[0][k]);
      more[k] = row(stretch_[1][k]) - from[k];
    }
    const auto dot = [](const double(&a)[3], const double(&b)[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
    return {{translation_[0][r] + dot(still_[r], from), translation_[1][r] - translation_[0][r] + dot(still_[r], more)},
            {dot(cosine_[r], from), dot(cosine_[r], more)},
            {dot(sine_[r], from), dot(sine_[r], more)},
            angle_,
            normalised_};
  }

  const double (&stretch(unsigned key) const)[3][3] { return stretch_[key]; }

 private:
  /// The rotation along the arc is still + cosine * cos(2 phi) + sine * sin(2 phi).
  void set_rotation(const TurningSegment& segment) {
    double q[2][4];
    for (unsigned k = 0; k < 2; ++k) {
      for (unsigned i = 0; i < 4; ++i) q[k][i] = segment.rotation[k][i];
      normalise(q[k]);
    }
    double dot = 0.0;
    for (unsigned i = 0; i < 4; ++i) dot += q[0][i] * q[1][i];
    for (unsigned i = 0; i < 4; ++i) q[1][i] -= dot * q[0][i];
    const double across = normalise(q[1]);
    angle_ = normalised_ ? std::atan2(across, dot) : double{segment.angle};
    double first[3][3], second[3][3], mixed[3][3];
    rotation(q[0], q[0], first);
    rotation(q[1], q[1], second);
    rotation(q[0], q[1], mixed);
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) {
        still_[r][c] = 0.5 * (first[r][c] + second[r][c]);
        cosine_[r][c] = 0.5 * (first[r][c] - second[r][c]);
        sine_[r][c] = mixed[r][c];
      }
  }
  /// @return the length before. A quaternion of length 0 stays the same.
  static double normalise(double (&q)[4]) {
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (length > 0.0)
      for (double& x : q) x /= length;
    return length;
  }
  /// The symmetric bilinear form that maps (q, q) to the rotation times the squared length.
  static void rotation(const double (&p)[4], const double (&q)[4], double (&m)[3][3]) {
    const auto mixed = [&](unsigned i, unsigned j) { return 0.5 * (p[i] * q[j] + p[j] * q[i]); };
    const double x = mixed(0, 0), y = mixed(1, 1), z = mixed(2, 2), w = mixed(3, 3);
    m[0][0] = w + x - y - z;
    m[1][1] = w - x + y - z;
    m[2][2] = w - x - y + z;
    for (unsigned r = 0; r < 3; ++r) {
      const unsigned c = (r + 1) % 3, other = (r + 2) % 3;
      m[r][c] = 2.0 * (mixed(r, c) - mixed(other, 3));
      m[c][r] = 2.0 * (mixed(r, c) + mixed(other, 3));
    }
  }

  double translation_[2][3];
  double still_[3][3] = {}, cosine_[3][3] = {}, sine_[3][3] = {};
  double stretch_[2][3][3] = {};
  double angle_ = 0.0;
  bool normalised_;
};

/// How much a motion's transforms magnify errors and stretch, over all times.
struct MotionMagnification {
  double condition = 1.0;  ///< The largest ratio of longest to shortest image of a unit vector.
  double rounding = 0.0;   ///< MotionRecord::rounding.
  double longest = 0.0;    ///< Length of the longest image of a unit vector.
  double farthest = 0.0;   ///< Length of the longest translation.
};

namespace motion_detail {

/// A time s between two keys where the transform is not invertible enough.
struct BadMatrix {
  double s, determinant;
};

inline double determinant(const double (&m)[3][3]) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

/// How fast the shortest image shrinks as a matrix changes, in units of itself.
///
/// M + x C = M (1 + x C') for C' = inverse(M) C. So its shortest image is at least (1 - x |C'|) times that of M. The
/// same holds with C inverse(M).
inline double relative_change(const double (&m)[3][3], const double (&change)[3][3]) {
  const LinearInverse inverse(m);
  double before = 0.0, behind = 0.0;
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 3; ++c) {
      double left = 0.0, right = 0.0;
      for (unsigned k = 0; k < 3; ++k) {
        left += inverse.row[r][k] * change[k][c];
        right += change[r][k] * inverse.row[k][c];
      }
      before += left * left;
      behind += right * right;
    }
  // The Euclidean norm is at most the Frobenius norm.
  return std::sqrt(std::min(before, behind)) * (1.0 + 0x1p-20);
}

/// The linear parts (1 - s) * from + s * to, s in [0, 1].
struct MatrixPath {
  const double (&from)[3][3];
  const double (&to)[3][3];
  double change[3][3];
  double slope = 0.0;  ///< The largest stretch of `change`.

  /// One matrix of the path.
  struct Sample {
    double m[3][3];
    Stretches stretches;
    double shrinking;  ///< relative_change().

    bool is_bad() const { return !(stretches.longest <= double{kMaxMotionCondition} * stretches.shortest); }
    double condition() const { return stretches.longest / stretches.shortest; }
  };

  /// A part of [0, 1], with the matrices at its ends.
  struct Interval {
    double begin, end;
    Sample first, last;

    double half() const { return 0.5 * (end - begin); }
  };

  MatrixPath(const double (&first)[3][3], const double (&last)[3][3]) : from(first), to(last) {
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) change[r][c] = to[r][c] - from[r][c];
    const bool still = std::all_of(&change[0][0], &change[0][0] + 9, [](double x) { return x == 0.0; });
    if (!still) slope = Stretches(change).longest;
  }

  Sample sample(double s) const {
    Sample at{{}, Stretches(from), 0.0};
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) at.m[r][c] = s == 1.0 ? to[r][c] : from[r][c] + s * change[r][c];
    at.stretches = Stretches(at.m);
    at.shrinking = relative_change(at.m, change);
    return at;
  }

  /// At most the shortest image of a unit vector in the interval. The shortest image changes by no more than the
  /// matrix, and by no more than relative_change() says.
  double least_stretch(const Interval& part) const {
    const Stretches &first = part.first.stretches, &last = part.last.stretches;
    // Each end bounds its half.
    const double by_size = std::min(first.shortest * (1.0 - part.half() * part.first.shrinking),
                                    last.shortest * (1.0 - part.half() * part.last.shrinking));
    return std::max(0.5 * (first.shortest + last.shortest) - slope * part.half(), by_size);
  }
};

/// The largest condition of (1 - s) * from + s * to, at most a twentieth too large. Intervals are halved until their
/// bounds are that tight. The longest image of a unit vector is longest at an end of an interval.
inline std::optional<BadMatrix> worst_condition(const double (&from)[3][3], const double (&to)[3][3], double& worst) {
  const MatrixPath path(from, to);
  std::vector<MatrixPath::Interval> pending{{0.0, 1.0, path.sample(0.0), path.sample(1.0)}};
  if (pending[0].first.is_bad()) return BadMatrix{0.0, determinant(pending[0].first.m)};
  if (pending[0].last.is_bad()) return BadMatrix{1.0, determinant(pending[0].last.m)};
  while (!pending.empty()) {
    const MatrixPath::Interval part = pending.back();
    pending.pop_back();
    const double least = path.least_stretch(part);
    const double most = std::max(part.first.stretches.longest, part.last.stretches.longest);
    const double here = std::max(part.first.condition(), part.last.condition());
    if (least > 0.0 && most / least <= std::max(worst, 1.05 * here)) {
      worst = std::max(worst, most / least);
      continue;
    }
    const double middle = part.begin + part.half();
    const MatrixPath::Sample center = path.sample(middle);
    if (center.is_bad()) return BadMatrix{middle, determinant(center.m)};
    pending.push_back({part.begin, middle, part.first, center});
    pending.push_back({middle, part.end, center, part.last});
  }
  return std::nullopt;
}

}  // namespace motion_detail

/// Adds the magnification of a segment.
/// @return s between the keys where the transform is refused, with its determinant.
inline std::optional<motion_detail::BadMatrix> magnify(MotionMagnification& sum, const MotionSegment& segment,
                                                       MotionKind kind) {
  const SegmentMotion motion(segment, kind);
  double condition = 1.0;
  if (const auto bad = motion_detail::worst_condition(motion.stretch(0), motion.stretch(1), condition)) return bad;
  sum.condition = std::max(sum.condition, condition);
  for (unsigned k = 0; k < 2; ++k) {
    sum.longest = std::max(sum.longest, Stretches(motion.stretch(k)).longest);
    const float(&t)[3] = segment.translation[k];
    sum.farthest = std::max(sum.farthest, std::hypot(double{t[0]}, double{t[1]}, double{t[2]}));
  }
  if (kind == MotionKind::kMatrix) {
    sum.rounding = std::max(sum.rounding, (6.0 + 2.0 * condition) / 14.0);
    return std::nullopt;
  }
  bool sheared = false;
  for (const float(&stretch)[6] : segment.turning.stretch)
    for (unsigned k = 3; k < 6; ++k) sheared = sheared || stretch[k] != 0.0f;
  sum.rounding = std::max(sum.rounding, (35.0 + 8.0 * (sheared ? 3.0 * condition * condition : 1.0)) / 14.0);
  return std::nullopt;
}

namespace motion_detail {

/// Calls visit(p) for the corners of a box.
template <class Visit> void for_each_corner(const Box& box, const Visit& visit) {
  for (unsigned corner = 0; corner < 8; ++corner) {
    double p[3];
    for (unsigned axis = 0; axis < 3; ++axis) p[axis] = (corner >> axis & 1u) != 0 ? box.max[axis] : box.min[axis];
    visit(p);
  }
}

/// The box from the low ends of some ranges to the high ends of others, rounded outwards.
inline Box rounded_box(const MotionRange (&low)[3], const MotionRange (&high)[3]) {
  Box result;
  for (unsigned axis = 0; axis < 3; ++axis) {
    result.min[axis] = affine_detail::round_down(low[axis].low);
    result.max[axis] = affine_detail::round_up(high[axis].high);
  }
  return result;
}

}  // namespace motion_detail

/// A box that contains the images of all points of @p box at all times of a motion.
/// @param slack as that of StillInstanceBounds; with 0 the box may be up to 2^-26 of the size too small.
inline Box bounds_in_motion(std::span<const SegmentMotion> segments, const Box& box, double slack = 1.0) {
  MotionRange range[3];
  for (const SegmentMotion& segment : segments)
    motion_detail::for_each_corner(box, [&](const double(&p)[3]) {
      for (unsigned axis = 0; axis < 3; ++axis) segment.curve(axis, p).grow(range[axis], slack);
    });
  return motion_detail::rounded_box(range, range);
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
