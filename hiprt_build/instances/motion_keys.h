#pragma once
/// Keys of motions as transforms, and the segments between them, in double. On hosts and devices. Internal.

#include <hiprt_build/format/box.h>
#include <hiprt_build/format/motion_bounds.h>
#include <hiprt_build/motion.h>

#include <cmath>
#include <cstdint>

namespace hiprt::build {

struct Quaternion {
  double x[4];  ///< x, y, z, w.
};

namespace motion_keys_detail {

HIPRT_HD inline bool is_finite(const float* numbers, unsigned count) {
  bool finite = true;
  for (unsigned i = 0; i < count; ++i) finite = finite && format_detail::is_finite(numbers[i]);
  return finite;
}

HIPRT_HD inline double dot(const double* a, const double* b, unsigned count) {
  double sum = a[0] * b[0];
  for (unsigned i = 1; i < count; ++i) sum += a[i] * b[i];
  return sum;
}
/// @return the length.
HIPRT_HD inline double normalise(double* v, unsigned count) {
  const double length = ::sqrt(dot(v, v, count));
  if (length > 0.0)
    for (unsigned i = 0; i < count; ++i) v[i] /= length;
  return length;
}

/// Of a rotation (Shepperd 1978): by the largest of its components, so that nothing cancels.
HIPRT_HD HIPRT_COLD Quaternion quaternion_of(const double (&r)[3][3]) {
  const double trace = r[0][0] + r[1][1] + r[2][2];
  Quaternion q{};
  unsigned k = 0;
  for (unsigned i = 1; i < 3; ++i)
    if (r[i][i] > r[k][k]) k = i;
  if (trace > r[k][k]) {
    q = {{r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1], 1.0 + trace}};
  } else {
    const unsigned i = (k + 1) % 3, j = (k + 2) % 3;
    q.x[k] = 1.0 + 2.0 * r[k][k] - trace;
    q.x[i] = r[k][i] + r[i][k];
    q.x[j] = r[k][j] + r[j][k];
    q.x[3] = r[j][i] - r[i][j];
  }
  normalise(q.x, 4);
  return q;
}

/// Of a unit quaternion.
HIPRT_HD inline void rotation_of(const Quaternion& q, double (&r)[3][3]) {
  const double x = q.x[0], y = q.x[1], z = q.x[2], w = q.x[3];
  const double rows[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                             {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                             {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
  for (unsigned i = 0; i < 3; ++i)
    for (unsigned j = 0; j < 3; ++j) r[i][j] = rows[i][j];
}

/// Gram-Schmidt on the columns of a matrix. @param u receives the upper triangular factor: columns before = after * u.
HIPRT_HD inline void orthonormalise(double (&column)[3][3], double (&u)[3][3]) {
  for (unsigned c = 0; c < 3; ++c) {
    // Twice is enough (Giraud and others 2005).
    for (unsigned again = 0; again < 2; ++again)
      for (unsigned k = 0; k < c; ++k) {
        const double along = dot(column[k], column[c], 3);
        u[k][c] += along;
        for (unsigned r = 0; r < 3; ++r) column[c][r] -= along * column[k][r];
      }
    u[c][c] = normalise(column[c], 3);
  }
}

/// The rotations of a segment. @return the second key's, on the side of the sphere of quaternions that is nearer to the
/// first's.
HIPRT_HD HIPRT_COLD Quaternion fill_rotations(const Quaternion& from, Quaternion to, MotionKind kind,
                                              TurningSegment& turning) {
  double along = dot(from.x, to.x, 4);
  if (along < 0.0) {
    for (double& x : to.x) x = -x;
    along = -along;
  }
  Quaternion across;
  for (unsigned i = 0; i < 4; ++i) across.x[i] = to.x[i] - along * from.x[i];
  const double length = normalise(across.x, 4);
  // Of the same orientation anything at a right angle.
  if (!(length > 0.0)) across = {{-from.x[1], from.x[0], -from.x[3], from.x[2]}};
  const Quaternion& second = kind == MotionKind::kSlerp ? across : to;
  for (unsigned i = 0; i < 4; ++i) {
    turning.rotation[0][i] = nearest_float(from.x[i]);
    turning.rotation[1][i] = nearest_float(second.x[i]);
  }
  turning.angle = kind == MotionKind::kSlerp ? nearest_float(::atan2(length, along)) : 0.0f;
  return to;
}

}  // namespace motion_keys_detail

HIPRT_HD inline Quaternion unit_rotation(const MotionKey& key) {
  Quaternion q{{key.rotation[0], key.rotation[1], key.rotation[2], key.rotation[3]}};
  motion_keys_detail::normalise(q.x, 4);
  return q;
}

/// Whether an instance is hidden at a key: scaled to nothing.
HIPRT_HD inline bool hides(const MotionKey& key) {
  bool zero = true;
  for (unsigned i = 0; i < 3; ++i) zero = zero && key.scale[i] == 0.0f && key.shear[i] == 0.0f;
  return zero;
}
HIPRT_HD inline bool hides(const MatrixKey& key) {
  bool zero = true;
  for (const auto& row : key.to_scene.row)
    for (unsigned c = 0; c < 3; ++c) zero = zero && row[c] == 0.0f;
  return zero;
}

HIPRT_HD HIPRT_COLD MotionFault fault_of(const MotionKey& key) {
  using namespace motion_keys_detail;
  if (!is_finite(key.translation, 3) || !is_finite(key.rotation, 4) || !is_finite(key.scale, 3) ||
      !is_finite(key.shear, 3))
    return MotionFault::kNotFinite;
  const Quaternion q = unit_rotation(key);
  if (dot(q.x, q.x, 4) == 0.0) return MotionFault::kNoRotation;
  for (const float scale : key.scale)
    if (scale == 0.0f && !hides(key)) return MotionFault::kZeroScale;
  return MotionFault::kNone;
}

/// decompose() of motion.h. @return kNone, kNotFinite or kNoInverse.
HIPRT_HD HIPRT_COLD MotionFault decompose_key(const MatrixKey& key, MotionKey& result) {
  using namespace motion_keys_detail;
  const auto& m = key.to_scene.row;
  if (!is_finite(&m[0][0], 12)) return MotionFault::kNotFinite;
  double column[3][3];
  for (unsigned c = 0; c < 3; ++c)
    for (unsigned r = 0; r < 3; ++r) column[c][r] = m[r][c];
  double u[3][3] = {};
  orthonormalise(column, u);
  const double handed = column[0][0] * (column[1][1] * column[2][2] - column[1][2] * column[2][1]) -
                        column[0][1] * (column[1][0] * column[2][2] - column[1][2] * column[2][0]) +
                        column[0][2] * (column[1][0] * column[2][1] - column[1][1] * column[2][0]);
  const double sign = handed < 0.0 ? -1.0 : 1.0;
  double rotation[3][3];
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 3; ++c) rotation[r][c] = sign * column[c][r];
  result.time = key.time;
  const Quaternion q = quaternion_of(rotation);
  for (unsigned i = 0; i < 4; ++i) result.rotation[i] = nearest_float(q.x[i]);
  for (unsigned i = 0; i < 3; ++i) {
    result.scale[i] = nearest_float(sign * u[i][i]);
    result.translation[i] = m[i][3];
  }
  result.shear[0] = nearest_float(sign * u[0][1]);
  result.shear[1] = nearest_float(sign * u[0][2]);
  result.shear[2] = nearest_float(sign * u[1][2]);
  return ::fabs(handed) > 0.5 && fault_of(result) == MotionFault::kNone ? MotionFault::kNone : MotionFault::kNoInverse;
}

/// compose() of motion.h.
HIPRT_HD HIPRT_COLD MatrixKey compose_key(const MotionKey& key) {
  double rotation[3][3];
  motion_keys_detail::rotation_of(unit_rotation(key), rotation);
  const double u[3][3] = {
      {key.scale[0], key.shear[0], key.shear[1]}, {0.0, key.scale[1], key.shear[2]}, {0.0, 0.0, key.scale[2]}};
  MatrixKey result;
  result.time = key.time;
  for (unsigned r = 0; r < 3; ++r) {
    for (unsigned c = 0; c < 3; ++c) {
      double sum = 0.0;
      for (unsigned k = 0; k <= c; ++k) sum += rotation[r][k] * u[k][c];
      result.to_scene.row[r][c] = nearest_float(sum);
    }
    result.to_scene.row[r][3] = key.translation[r];
  }
  return result;
}

/// The segment between two keys. @pre fault_of() both is kNone.
/// @param orientation of the first key; becomes that of the second.
HIPRT_HD inline MotionSegment make_segment(const MotionKey& from, const MotionKey& to, MotionKind kind,
                                           Quaternion& orientation) {
  MotionSegment segment{};
  segment.turning = TurningSegment{};
  orientation = motion_keys_detail::fill_rotations(orientation, unit_rotation(to), kind, segment.turning);
  const MotionKey* const keys[2] = {&from, &to};
  for (unsigned k = 0; k < 2; ++k) {
    segment.time[k] = keys[k]->time;
    for (unsigned i = 0; i < 3; ++i) {
      segment.turning.stretch[k][i] = keys[k]->scale[i];
      segment.turning.stretch[k][3 + i] = keys[k]->shear[i];
      segment.translation[k][i] = keys[k]->translation[i];
    }
  }
  return segment;
}

/// The same for MotionKind::kMatrix.
HIPRT_HD inline MotionSegment make_segment(const MatrixKey& from, const MatrixKey& to) {
  MotionSegment segment{};
  const MatrixKey* const keys[2] = {&from, &to};
  for (unsigned k = 0; k < 2; ++k) {
    segment.time[k] = keys[k]->time;
    for (unsigned r = 0; r < 3; ++r) {
      for (unsigned c = 0; c < 3; ++c) segment.linear[k][r][c] = keys[k]->to_scene.row[r][c];
      segment.translation[k][r] = keys[k]->to_scene.row[r][3];
    }
  }
  return segment;
}

/// Of two keys one after the other.
HIPRT_HD inline MotionFault fault_between(float before, float time) {
  return time > before && motion_keys_detail::is_finite(&time, 1) && time - before <= 0x1.fffffep127f
             ? MotionFault::kNone
             : MotionFault::kBadTime;
}

/// Whether scales have the same signs in both keys, if both can be seen. Otherwise the transform has no inverse at some
/// time between them.
HIPRT_HD inline MotionFault fault_of_signs(const MotionKey& before, const MotionKey& key) {
  bool same = true;
  if (hides(before) || hides(key)) return MotionFault::kNone;
  for (unsigned axis = 0; axis < 3; ++axis) same = same && (before.scale[axis] < 0.0f) == (key.scale[axis] < 0.0f);
  return same ? MotionFault::kNone : MotionFault::kSignChange;
}

}  // namespace hiprt::build
