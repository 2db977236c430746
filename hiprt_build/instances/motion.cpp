#include <hiprt_build/input/check_input.h>
#include <hiprt_build/instances/motion_segments.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace hiprt::build {
namespace {

using Double3 = std::array<double, 3>;
using Quaternion = std::array<double, 4>;

double dot(const Double3& a, const Double3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double dot(const Quaternion& a, const Quaternion& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]; }
/// @return the length.
template <class Vector> double normalise(Vector& v) {
  const double length = std::sqrt(dot(v, v));
  if (length > 0.0)
    for (double& x : v) x /= length;
  return length;
}

bool all_finite(std::span<const float> numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](float x) { return std::isfinite(x); });
}

/// Of a rotation (Shepperd 1978): by the largest of its components, so that nothing cancels.
Quaternion quaternion_of(const double (&r)[3][3]) {
  const double trace = r[0][0] + r[1][1] + r[2][2];
  Quaternion q{};
  unsigned k = 0;
  for (unsigned i = 1; i < 3; ++i)
    if (r[i][i] > r[k][k]) k = i;
  if (trace > r[k][k]) {
    q = {r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1], 1.0 + trace};
  } else {
    const unsigned i = (k + 1) % 3, j = (k + 2) % 3;
    q[k] = 1.0 + 2.0 * r[k][k] - trace;
    q[i] = r[k][i] + r[i][k];
    q[j] = r[k][j] + r[j][k];
    q[3] = r[j][i] - r[i][j];
  }
  normalise(q);
  return q;
}

/// Of a unit quaternion.
void rotation_of(const Quaternion& q, double (&r)[3][3]) {
  const auto [x, y, z, w] = q;
  const double rows[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                             {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                             {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
  std::copy(&rows[0][0], &rows[0][0] + 9, &r[0][0]);
}

Quaternion unit_rotation(const MotionKey& key) {
  Quaternion q{key.rotation[0], key.rotation[1], key.rotation[2], key.rotation[3]};
  normalise(q);
  return q;
}

/// What is wrong with a key, or nothing.
std::string fault_of(const MotionKey& key) {
  if (!all_finite(key.translation) || !all_finite(key.rotation) || !all_finite(key.scale) || !all_finite(key.shear))
    return "a number is not finite";
  Quaternion q = unit_rotation(key);
  if (dot(q, q) == 0.0) return "the rotation has length 0";
  for (const float scale : key.scale)
    if (scale == 0.0f) return "the scale has a 0";
  return {};
}

void fill_stretch(const MotionKey& key, float (&stretch)[6]) {
  std::copy_n(key.scale, 3, stretch);
  std::copy_n(key.shear, 3, stretch + 3);
}

/// The rotations of a segment. @return the second key's, on the side of the sphere of quaternions that is nearer to the
/// first's.
Quaternion fill_rotations(const Quaternion& from, Quaternion to, MotionKind kind, TurningSegment& turning) {
  double along = dot(from, to);
  if (along < 0.0) {
    for (double& x : to) x = -x;
    along = -along;
  }
  Quaternion across;
  for (unsigned i = 0; i < 4; ++i) across[i] = to[i] - along * from[i];
  const double length = normalise(across);
  // Of the same orientation anything at a right angle.
  if (!(length > 0.0)) across = {-from[1], from[0], -from[3], from[2]};
  const Quaternion& second = kind == MotionKind::kSlerp ? across : to;
  for (unsigned i = 0; i < 4; ++i) {
    turning.rotation[0][i] = nearest_float(from[i]);
    turning.rotation[1][i] = nearest_float(second[i]);
  }
  turning.angle = kind == MotionKind::kSlerp ? static_cast<float>(std::atan2(length, along)) : 0.0f;
  return to;
}

/// Times in order, and far less than the largest float apart.
std::string fault_of_times(std::span<const float> times) {
  for (std::size_t i = 0; i < times.size(); ++i) {
    const std::string key = "key " + std::to_string(i) + ": time " + text(times[i]);
    if (!std::isfinite(times[i])) return key + " is not finite";
    if (i > 0 && !(times[i] > times[i - 1])) return key + " is not after that of the key before, " + text(times[i - 1]);
    if (i > 0 && !std::isfinite(times[i] - times[i - 1])) return key + " is too far from that of the key before";
  }
  return {};
}

/// Between two keys without its times.
MotionSegment turning_segment(const MotionKey& from, const MotionKey& to, MotionKind kind, Quaternion& orientation) {
  MotionSegment segment{};
  segment.turning = TurningSegment{};
  orientation = fill_rotations(orientation, unit_rotation(to), kind, segment.turning);
  fill_stretch(from, segment.turning.stretch[0]);
  fill_stretch(to, segment.turning.stretch[1]);
  std::copy_n(from.translation, 3, segment.translation[0]);
  std::copy_n(to.translation, 3, segment.translation[1]);
  return segment;
}

MotionSegment matrix_segment(const MatrixKey& from, const MatrixKey& to) {
  MotionSegment segment{};
  const MatrixKey* const keys[2] = {&from, &to};
  for (unsigned k = 0; k < 2; ++k)
    for (unsigned r = 0; r < 3; ++r) {
      std::copy_n(keys[k]->to_scene.row[r], 3, segment.linear[k][r]);
      segment.translation[k][r] = keys[k]->to_scene.row[r][3];
    }
  return segment;
}

Result<std::vector<MotionKey>> keys_of(const Motion& motion) {
  if (motion.matrices.empty()) return motion.keys;
  std::vector<MotionKey> keys;
  for (std::size_t i = 0; i < motion.matrices.size(); ++i) {
    auto key = decompose(motion.matrices[i]);
    if (!key) return tl::unexpected(invalid("key " + std::to_string(i) + ": " + key.error().message));
    keys.push_back(*key);
  }
  return keys;
}

/// Segments of a motion that turns. @return what is wrong, or nothing.
std::string add_turning(std::span<const MotionKey> keys, MotionKind kind, MotionParts& parts) {
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (const std::string fault = fault_of(keys[i]); !fault.empty()) return "key " + std::to_string(i) + ": " + fault;
    for (unsigned axis = 0; i > 0 && axis < 3; ++axis)
      if (std::signbit(keys[i].scale[axis]) != std::signbit(keys[i - 1].scale[axis]))
        return "key " + std::to_string(i) + ": the scale changes its sign: at some time the transform has no inverse";
  }
  parts.first = compose(keys[0]);
  Quaternion orientation = unit_rotation(keys[0]);
  for (std::size_t i = 1; i < keys.size(); ++i)
    parts.segments.push_back(turning_segment(keys[i - 1], keys[i], kind, orientation));
  return {};
}

std::string add_matrices(std::span<const MatrixKey> keys, MotionParts& parts) {
  for (std::size_t i = 0; i < keys.size(); ++i)
    if (!all_finite({&keys[i].to_scene.row[0][0], 12})) return "key " + std::to_string(i) + ": a number is not finite";
  parts.first = keys[0];
  for (std::size_t i = 1; i < keys.size(); ++i) parts.segments.push_back(matrix_segment(keys[i - 1], keys[i]));
  return {};
}

/// Gram-Schmidt on the columns of a matrix. @param u receives the upper triangular factor: columns before = after * u.
void orthonormalise(Double3 (&column)[3], double (&u)[3][3]) {
  for (unsigned c = 0; c < 3; ++c) {
    // Twice is enough (Giraud and others 2005).
    for (unsigned again = 0; again < 2; ++again)
      for (unsigned k = 0; k < c; ++k) {
        const double along = dot(column[k], column[c]);
        u[k][c] += along;
        for (unsigned r = 0; r < 3; ++r) column[c][r] -= along * column[k][r];
      }
    u[c][c] = normalise(column[c]);
  }
}

}  // namespace

Result<MotionParts> make_motion(const Motion& motion) {
  if (motion.keys.empty() == motion.matrices.empty())
    return tl::unexpected(invalid("a motion has keys, or matrices, one of them at least"));
  if (motion.kind < MotionKind::kSlerp || motion.kind > MotionKind::kMatrix)
    return tl::unexpected(invalid("a motion of unknown kind " + std::to_string(static_cast<unsigned>(motion.kind))));
  std::vector<float> times;
  for (const MotionKey& key : motion.keys) times.push_back(key.time);
  for (const MatrixKey& key : motion.matrices) times.push_back(key.time);
  if (std::string fault = fault_of_times(times); !fault.empty()) return tl::unexpected(invalid(std::move(fault)));
  MotionParts parts;
  std::string fault;
  if (motion.kind == MotionKind::kMatrix) {
    std::vector<MatrixKey> matrices = motion.matrices;
    for (const MotionKey& key : motion.keys) matrices.push_back(compose(key));
    fault = add_matrices(matrices, parts);
  } else {
    auto keys = keys_of(motion);
    if (!keys) return tl::unexpected(std::move(keys.error()));
    fault = add_turning(*keys, motion.kind, parts);
  }
  if (!fault.empty()) return tl::unexpected(invalid(std::move(fault)));
  for (std::size_t i = 0; i < parts.segments.size(); ++i) {
    std::copy_n(&times[i], 2, parts.segments[i].time);
    if (const auto bad = magnify(parts.magnification, parts.segments[i], motion.kind))
      return tl::unexpected(invalid("between keys " + std::to_string(i) + " and " + std::to_string(i + 1) + ", at " +
                                    text(bad->s) + " of the way, the transform has no inverse that floats can hold: " +
                                    "determinant " + text(bad->determinant)));
  }
  return parts;
}

Result<MotionKey> decompose(const MatrixKey& key) {
  const auto& m = key.to_scene.row;
  if (!all_finite({&m[0][0], 12})) return tl::unexpected(invalid("the matrix is not finite"));
  Double3 column[3];
  for (unsigned c = 0; c < 3; ++c) column[c] = {m[0][c], m[1][c], m[2][c]};
  double u[3][3] = {};
  orthonormalise(column, u);
  const double handed = column[0][0] * (column[1][1] * column[2][2] - column[1][2] * column[2][1]) -
                        column[0][1] * (column[1][0] * column[2][2] - column[1][2] * column[2][0]) +
                        column[0][2] * (column[1][0] * column[2][1] - column[1][1] * column[2][0]);
  const double sign = handed < 0.0 ? -1.0 : 1.0;
  double rotation[3][3];
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 3; ++c) rotation[r][c] = sign * column[c][r];
  MotionKey result;
  result.time = key.time;
  const Quaternion q = quaternion_of(rotation);
  for (unsigned i = 0; i < 4; ++i) result.rotation[i] = nearest_float(q[i]);
  for (unsigned i = 0; i < 3; ++i) {
    result.scale[i] = nearest_float(sign * u[i][i]);
    result.translation[i] = m[i][3];
  }
  result.shear[0] = nearest_float(sign * u[0][1]);
  result.shear[1] = nearest_float(sign * u[0][2]);
  result.shear[2] = nearest_float(sign * u[1][2]);
  float linear[3][3];
  for (unsigned r = 0; r < 3; ++r) std::copy_n(m[r], 3, linear[r]);
  if (!(std::fabs(handed) > 0.5) || !fault_of(result).empty())
    return tl::unexpected(invalid("the matrix has no inverse that floats can hold: determinant " +
                                  text(LinearInverse(linear).determinant)));
  return result;
}

MatrixKey compose(const MotionKey& key) {
  double rotation[3][3];
  rotation_of(unit_rotation(key), rotation);
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

}  // namespace hiprt::build
