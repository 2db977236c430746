#pragma once
/// Bounds of moving instances over all times, in double. On hosts and devices.
///
/// Curves (motion_curve.h) bound each coordinate of a moving point.

#include <hiprt_build/format/motion_curve.h>
#include <hiprt_device/format/motion.h>
#include <hiprt_device/math/affine.h>

#include <span>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// A segment of a motion, in double: the transform of at_time() without its rounding.
class SegmentMotion {
 public:
  HIPRT_HD HIPRT_COLD SegmentMotion(const MotionSegment& segment, MotionKind kind)
      : normalised_(kind == MotionKind::kNlerp) {
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
  HIPRT_HD HIPRT_COLD MotionCurve curve(unsigned r, const double (&p)[3]) const {
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

  HIPRT_HD const double (&stretch(unsigned key) const)[3][3] { return stretch_[key]; }

 private:
  /// The rotation along the arc is still + cosine * cos(2 phi) + sine * sin(2 phi).
  HIPRT_HD void set_rotation(const TurningSegment& segment) {
    double q[2][4];
    for (unsigned k = 0; k < 2; ++k) {
      for (unsigned i = 0; i < 4; ++i) q[k][i] = segment.rotation[k][i];
      normalise(q[k]);
    }
    double dot = 0.0;
    for (unsigned i = 0; i < 4; ++i) dot += q[0][i] * q[1][i];
    for (unsigned i = 0; i < 4; ++i) q[1][i] -= dot * q[0][i];
    const double across = normalise(q[1]);
    angle_ = normalised_ ? ::atan2(across, dot) : double{segment.angle};
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
  HIPRT_HD static double normalise(double (&q)[4]) {
    const double length = ::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (length > 0.0)
      for (double& x : q) x /= length;
    return length;
  }
  /// The symmetric bilinear form that maps (q, q) to the rotation times the squared length.
  HIPRT_HD static void rotation(const double (&p)[4], const double (&q)[4], double (&m)[3][3]) {
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

/// The length of a vector; squares do not overflow.
HIPRT_HD inline double length(const float (&v)[3]) {
  double scale = 0.0, sum = 0.0;
  for (const float x : v) scale = affine_detail::larger(scale, ::fabs(double{x}));
  if (scale == 0.0) return 0.0;
  for (const float x : v) sum += (x / scale) * (x / scale);
  return scale * ::sqrt(sum);
}

/// A time s between two keys where the transform is not invertible enough.
struct BadMatrix {
  double s, determinant;
};

HIPRT_HD inline double determinant(const double (&m)[3][3]) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

/// Whether an instance is hidden at a key with this linear part.
HIPRT_HD inline bool is_zero(const double (&m)[3][3]) {
  bool zero = true;
  for (const double(&row)[3] : m)
    for (const double x : row) zero = zero && x == 0.0;
  return zero;
}

/// How fast the shortest image shrinks as a matrix changes, in units of itself.
///
/// M + x C = M (1 + x C') for C' = inverse(M) C. So its shortest image is at least (1 - x |C'|) times that of M. The
/// same holds with C inverse(M).
HIPRT_HD inline double relative_change(const double (&m)[3][3], const double (&change)[3][3]) {
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
  return ::sqrt(affine_detail::smaller(before, behind)) * (1.0 + 0x1p-20);
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

    HIPRT_HD bool is_bad() const { return !(stretches.longest <= double{kMaxMotionCondition} * stretches.shortest); }
    HIPRT_HD double condition() const { return stretches.longest / stretches.shortest; }
  };

  /// A part of [0, 1], with the matrices at its ends.
  struct Interval {
    double begin, end;
    Sample first, last;

    HIPRT_HD double half() const { return 0.5 * (end - begin); }
  };

  HIPRT_HD MatrixPath(const double (&first)[3][3], const double (&last)[3][3]) : from(first), to(last) {
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) change[r][c] = to[r][c] - from[r][c];
    bool still = true;
    for (const double(&row)[3] : change)
      for (const double x : row) still = still && x == 0.0;
    if (!still) slope = Stretches(change).longest;
  }

  HIPRT_HD HIPRT_COLD Sample sample(double s) const {
    Sample at{{}, Stretches(from), 0.0};
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) at.m[r][c] = s == 1.0 ? to[r][c] : from[r][c] + s * change[r][c];
    at.stretches = Stretches(at.m);
    at.shrinking = relative_change(at.m, change);
    return at;
  }

  /// At most the shortest image of a unit vector in the interval. The shortest image changes by no more than the
  /// matrix, and by no more than relative_change() says.
  HIPRT_HD double least_stretch(const Interval& part) const {
    const Stretches &first = part.first.stretches, &last = part.last.stretches;
    // Each end bounds its half.
    const double by_size = affine_detail::smaller(first.shortest * (1.0 - part.half() * part.first.shrinking),
                                                  last.shortest * (1.0 - part.half() * part.last.shrinking));
    return affine_detail::larger(0.5 * (first.shortest + last.shortest) - slope * part.half(), by_size);
  }
};

/// The largest condition of (1 - s) * from + s * to, at most a twentieth too large. Intervals are halved until their
/// bounds are that tight. The longest image of a unit vector is longest at an end of an interval.
///
/// The intervals come from right to left. [(number - 1) * width, number * width] is the next one, so no stack is
/// needed.
/// @return false: @p bad says where the transform is not invertible enough.
/// It ends: halves that doubles cannot tell apart are refused. Only next to s = 0 doubles tell all halves apart.
HIPRT_HD HIPRT_COLD bool worst_on_path(const double (&from)[3][3], const double (&to)[3][3], double& worst,
                                       BadMatrix& bad) {
  const MatrixPath path(from, to);
  const auto refuse = [&](double s, const MatrixPath::Sample& sample) {
    bad = {s, determinant(sample.m)};
    return false;
  };
  MatrixPath::Interval part{0.0, 1.0, path.sample(0.0), path.sample(1.0)};
  if (part.first.is_bad()) return refuse(0.0, part.first);
  if (part.last.is_bad()) return refuse(1.0, part.last);
  std::uint64_t number = 1;
  for (double width = 1.0;;) {
    const double least = path.least_stretch(part);
    const double most = affine_detail::larger(part.first.stretches.longest, part.last.stretches.longest);
    const double here = affine_detail::larger(part.first.condition(), part.last.condition());
    if (!(least > 0.0 && most / least <= affine_detail::larger(worst, 1.05 * here))) {
      const double middle = part.begin + part.half();
      const MatrixPath::Sample center = path.sample(middle);
      if (center.is_bad() || !(part.begin < middle && middle < part.end)) return refuse(middle, center);
      part.begin = middle;
      part.first = center;
      width *= 0.5;
      number *= 2;
      continue;
    }
    worst = affine_detail::larger(worst, most / least);
    if (part.begin == 0.0) return true;
    // A left half ends its whole, which may itself be a left half.
    for (; number % 2 == 1; number = (number + 1) / 2) width *= 2.0;
    --number;
    part.end = part.begin;
    part.last = part.first;
    part.begin = part.end - width;
    part.first = path.sample(part.begin);
  }
}

/// The same from either end: a matrix far smaller than the other needs the halves next to s = 0.
HIPRT_HD inline bool worst_condition(const double (&from)[3][3], const double (&to)[3][3], double& worst,
                                     BadMatrix& bad) {
  if (!(Stretches(to).longest < 0x1p-30 * Stretches(from).longest)) return worst_on_path(from, to, worst, bad);
  const bool good = worst_on_path(to, from, worst, bad);
  bad.s = 1.0 - bad.s;
  return good;
}

}  // namespace motion_detail

/// Adds the magnification of a segment. Where an instance is hidden nothing is magnified.
/// @return false: the transform is refused somewhere between the keys; @p bad says where.
HIPRT_HD inline bool magnify(MotionMagnification& sum, const MotionSegment& segment, MotionKind kind,
                             motion_detail::BadMatrix& bad) {
  using affine_detail::larger;
  const SegmentMotion motion(segment, kind);
  const bool hidden[2] = {motion_detail::is_zero(motion.stretch(0)), motion_detail::is_zero(motion.stretch(1))};
  double condition = 1.0;
  // Between zero and a matrix are its multiples, which have its condition.
  const unsigned from = hidden[0] ? 1 : 0, to = hidden[1] ? 0 : 1;
  if (!(hidden[0] && hidden[1]) &&
      !motion_detail::worst_condition(motion.stretch(from), motion.stretch(to), condition, bad))
    return false;
  sum.condition = larger(sum.condition, condition);
  for (unsigned k = 0; k < 2; ++k) {
    if (!hidden[k]) sum.longest = larger(sum.longest, Stretches(motion.stretch(k)).longest);
    const float(&t)[3] = segment.translation[k];
    sum.farthest = larger(sum.farthest, motion_detail::length(t));
  }
  if (kind == MotionKind::kMatrix) {
    sum.rounding = larger(sum.rounding, (6.0 + 2.0 * condition) / 14.0);
    return true;
  }
  bool sheared = false;
  for (const float(&stretch)[6] : segment.turning.stretch)
    for (unsigned k = 3; k < 6; ++k) sheared = sheared || stretch[k] != 0.0f;
  sum.rounding = larger(sum.rounding, (35.0 + 8.0 * (sheared ? 3.0 * condition * condition : 1.0)) / 14.0);
  return true;
}

namespace motion_detail {

/// Calls visit(p) for the corners of a box.
template <class Visit> HIPRT_HD void for_each_corner(const Box& box, const Visit& visit) {
  for (unsigned corner = 0; corner < 8; ++corner) {
    double p[3];
    for (unsigned axis = 0; axis < 3; ++axis) p[axis] = (corner >> axis & 1u) != 0 ? box.max[axis] : box.min[axis];
    visit(p);
  }
}

/// The box from the low ends of some ranges to the high ends of others, rounded outwards.
HIPRT_HD inline Box rounded_box(const MotionRange (&low)[3], const MotionRange (&high)[3]) {
  Box result;
  for (unsigned axis = 0; axis < 3; ++axis) {
    result.min[axis] = affine_detail::round_down(low[axis].low);
    result.max[axis] = affine_detail::round_up(high[axis].high);
  }
  return result;
}

}  // namespace motion_detail

/// A box that contains the images of all points of @p box at all times, within the rounding of docs/proofs/motion.md.
/// @param slack as that of StillInstanceBounds; with 0 the box may be up to 2^-26 of the size too small.
HIPRT_HD inline Box bounds_in_motion(std::span<const SegmentMotion> segments, const Box& box, double slack = 1.0) {
  MotionRange range[3];
  for (const SegmentMotion& segment : segments)
    motion_detail::for_each_corner(box, [&](const double(&p)[3]) {
      for (unsigned axis = 0; axis < 3; ++axis) segment.curve(axis, p).grow(range[axis], slack);
    });
  return motion_detail::rounded_box(range, range);
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
