#pragma once
/// The transform of a moving instance at a time. It has the same bits on every machine.

#include <hiprt_device/format/motion.h>
#include <hiprt_device/math/affine.h>
#include <hiprt_device/math/memory.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace motion_detail {

/// Sine of x in [0, pi / 2]: relative error below 2^-23. The cosine's is absolute. Polynomials through Chebyshev
/// nodes.
HIPRT_HD HIPRT_FORCE_INLINE float sine(float x) {
  const float y = x * x;
  float p = fused_multiply_add(y, 2.6050929577697620e-6f, -1.98090110670521708e-4f);
  p = fused_multiply_add(y, p, 8.3330500867789368e-3f);
  p = fused_multiply_add(y, p, -0.166666579443922146f);
  return fused_multiply_add(x * y, p, x);
}
HIPRT_HD HIPRT_FORCE_INLINE float cosine(float x) {
  const float y = x * x;
  float p = fused_multiply_add(y, -2.6050510636020650e-7f, 2.47601015166303569e-5f);
  p = fused_multiply_add(y, p, -1.388836012778982544e-3f);
  p = fused_multiply_add(y, p, 0.0416666361476393609f);
  p = fused_multiply_add(y, p, -0.499999993551181271f);
  return fused_multiply_add(y, p, 1.0f);
}

/// Interpolates between a at s = 0 and b at s = 1, both exact, with r = 1 - s.
HIPRT_HD HIPRT_FORCE_INLINE float between(float a, float b, float r, float s) {
  return fused_multiply_add(s, b, r * a);
}

/// The unit rows of the rotation's inverse, from a quaternion of any length.
struct InverseRotation {
  float row[3][3];

  HIPRT_HD HIPRT_FORCE_INLINE explicit InverseRotation(const float (&q)[4]) {
    const auto [x, y, z, w] = q;
    const float squared = fused_multiply_add(x, x, fused_multiply_add(y, y, fused_multiply_add(z, z, w * w)));
    const float two = divided(2.0f, squared), tx = two * x, ty = two * y, tz = two * z;
    const auto off = [](float a, float b, float c, float d) { return fused_multiply_add(a, b, c * d); };
    row[0][0] = 1.0f - off(ty, y, tz, z);
    row[1][1] = 1.0f - off(tx, x, tz, z);
    row[2][2] = 1.0f - off(tx, x, ty, y);
    row[0][1] = off(tx, y, tz, w);
    row[1][0] = off(tx, y, -tz, w);
    row[0][2] = off(tx, z, -ty, w);
    row[2][0] = off(tx, z, ty, w);
    row[1][2] = off(ty, z, tx, w);
    row[2][1] = off(ty, z, -tx, w);
  }
};

/// inverse(U) * inverse(R), by back substitution.
HIPRT_HD HIPRT_FORCE_INLINE void invert_turning(const TurningSegment& segment, MotionKind kind, float s,
                                                float (&linear)[3][3]) {
  const float r = 1.0f - s;
  const float turn = s * segment.angle;
  const bool arc = kind == MotionKind::kSlerp;
  const float first = arc ? cosine(turn) : r, second = arc ? sine(turn) : s;
  float q[4], u[6];
  for (unsigned k = 0; k < 4; ++k) q[k] = between(segment.rotation[0][k], segment.rotation[1][k], first, second);
  const InverseRotation turned(q);
  for (unsigned k = 0; k < 6; ++k) u[k] = between(segment.stretch[0][k], segment.stretch[1][k], r, s);
  const float x = divided(1.0f, u[0]), y = divided(1.0f, u[1]), z = divided(1.0f, u[2]);
  for (unsigned c = 0; c < 3; ++c) {
    linear[2][c] = z * turned.row[2][c];
    linear[1][c] = y * fused_multiply_add(-u[5], linear[2][c], turned.row[1][c]);
    linear[0][c] =
        x * fused_multiply_add(-u[3], linear[1][c], fused_multiply_add(-u[4], linear[2][c], turned.row[0][c]));
  }
}

/// The inverse of the interpolated matrix, in double, rounded once. It computes one entry at a time from memory,
/// because registers limit how many rays a GPU traces at a time.
HIPRT_HD HIPRT_FORCE_INLINE void invert_matrix(const MotionSegment& segment, float s, float (&linear)[3][3]) {
  const auto between = [&](unsigned r, unsigned c) HIPRT_FORCE_INLINE_LAMBDA {
    const double a = segment.linear[0][r][c], b = segment.linear[1][r][c];
    return fused_multiply_add(static_cast<double>(s), b - a, a);
  };
  const double determinant = affine_detail::determinant<double>(between);
  HIPRT_NO_UNROLL_ON_NVIDIA
  for (unsigned k = 0; k < 9; ++k) {
    const unsigned r = k / 3, c = k - 3 * r;
    linear[r][c] = nearest_float(affine_detail::cofactor<double>(between, c, r) / determinant);
  }
}

}  // namespace motion_detail

/// The last segment that begins no later than a time, or the first segment.
/// @param begin_of the begin of segment i; it grows with i.
template <class BeginOf>
HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t segment_at(std::uint32_t segments, float time, BeginOf&& begin_of) {
  std::uint32_t low = 0, high = segments;
  while (high - low > 1) {
    const std::uint32_t middle = low + (high - low) / 2;
    if (begin_of(middle) <= time)
      low = middle;
    else
      high = middle;
  }
  return low;
}

/// The fraction of a segment that has passed at a time: from 0 to 1. NaN if the time is NaN.
HIPRT_HD HIPRT_FORCE_INLINE float part_of(float begin, float end, float time) {
  return time <= begin ? 0.0f : time >= end ? 1.0f : divided(time - begin, end - begin);
}

/// The instance at a time, as a record that stands still (instance.h).
/// @param instance, of_motion, base the instance's records and the first byte of the file that has them.
/// @param time not NaN. Before the first key and after the last, the instance stands where the key says.
HIPRT_HD HIPRT_OUTLINE InstanceRecord at_time(const InstanceRecord& instance, const MotionRecord& of_motion,
                                              const std::byte* base, float time) {
  const MotionRecord motion = load_record(of_motion);
  if (motion.count == 0) return load_record(instance);
  InstanceRecord placed{};
  placed.object = instance.object;
  placed.mask = instance.mask;
  placed.id = instance.id;
  placed.flags = instance.flags;
  const auto* segments = reinterpret_cast<const MotionSegment*>(base + motion.segments);
  const MotionSegment& segment =
      segments[segment_at(motion.count, time, [&](std::uint32_t i) { return segments[i].time[0]; })];
  const float s = part_of(segment.time[0], segment.time[1], time);
  if (motion.kind == MotionKind::kMatrix)
    motion_detail::invert_matrix(segment, s, placed.linear);
  else
    motion_detail::invert_turning(segment.turning, motion.kind, s, placed.linear);
  for (unsigned k = 0; k < 3; ++k)
    placed.translation[k] = motion_detail::between(segment.translation[0][k], segment.translation[1][k], 1.0f - s, s);
  return placed;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
