#pragma once
/// Motion of instances: their transforms at times. Normative text: hiprt_device/docs/FORMAT.md. Reasons:
/// hiprt_device/docs/decisions/0015-motion.md.

#include <hiprt_device/format/portability.h>

namespace hiprt {

/// How an instance moves from key to key.
enum class MotionKind : std::uint32_t {
  kSlerp = 1,   ///< Translation, scale and shear move linearly, the rotation along its arc with constant speed.
  kNlerp = 2,   ///< The same, but the rotation moves linearly and is normalised: the same arc, faster in its middle.
  kMatrix = 3,  ///< The matrix moves linearly. A turning object shrinks between the keys.
};

/// The motion of one instance. Record i belongs to instance i.
struct MotionRecord {
  std::uint64_t segments;  ///< Offset, in the file that has the instance, of its first MotionSegment.
  std::uint32_t count;     ///< Number of segments, in the order of time; 0: the instance stands still.
  MotionKind kind;         ///< 0 if it stands still.
  float rounding;  ///< Rounding of the transform at a time, as the device computes it, in units of 14 * 2^-24 (decision
                   ///< 0015).
  float farthest;  ///< Length of the longest translation of a key.
  std::uint32_t reserved[2];
};

/// The turning part of a key and the next. A point of the object is at R * U * p + translation.
struct TurningSegment {
  /// Unit quaternions (x, y, z, w).
  ///
  /// kSlerp: the orientation at the first key, and the orientation at a right angle to it on the arc to the second
  /// key. q(s) = cos(s * angle) * rotation[0] + sin(s * angle) * rotation[1].
  ///
  /// kNlerp: the orientations of both keys. q(s) = (1 - s) * rotation[0] + s * rotation[1].
  float rotation[2][4];
  float angle;          ///< kSlerp: angle between the quaternions, half of the rotation's angle; in [0, pi / 2].
  float stretch[2][6];  ///< U, upper triangular: diagonal (scale), then xy, xz, yz (shear). Scales keep their signs.
};

/// The motion from one key to the next. Before the first key and after the last an instance stands still.
struct alignas(128) MotionSegment {
  float time[2];  ///< Times of the keys; the second is later.
  float translation[2][3];
  union {
    TurningSegment turning;  ///< kSlerp, kNlerp.
    float linear[2][3][3];   ///< kMatrix: rows, from the object to the scene.
  };
  float reserved[3];
};

static_assert(sizeof(MotionRecord) == 32 && sizeof(TurningSegment) == 84 && sizeof(MotionSegment) == 128);
#if !HIPRT_RUN_TIME_COMPILER  // Run-time compilers have no offsetof.
static_assert(offsetof(MotionRecord, segments) == 0 && offsetof(MotionRecord, count) == 8);
static_assert(offsetof(MotionRecord, kind) == 12 && offsetof(MotionRecord, rounding) == 16);
static_assert(offsetof(MotionRecord, farthest) == 20 && offsetof(MotionRecord, reserved) == 24);
static_assert(offsetof(MotionSegment, time) == 0 && offsetof(MotionSegment, translation) == 8);
static_assert(offsetof(MotionSegment, turning) == 32 && offsetof(MotionSegment, linear) == 32);
static_assert(offsetof(MotionSegment, reserved) == 116);
static_assert(offsetof(TurningSegment, rotation) == 0 && offsetof(TurningSegment, angle) == 32);
static_assert(offsetof(TurningSegment, stretch) == 36);
#endif

/// The largest condition of a moving instance's transform at any time: it is inverted at the ray's time.
inline constexpr float kMaxMotionCondition = 0x1p20f;

}  // namespace hiprt
