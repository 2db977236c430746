#pragma once
/// Which primitives a builder drops (input.h). Internal.

#include <hiprt_device/format/node.h>

#include <limits>

namespace hiprt::build {

/// Equal as numbers: 0 and -0 are.
HIPRT_HD HIPRT_FORCE_INLINE bool same_position(const float* a, const float* b) {
  return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/// Why a primitive is dropped. kBadIndex: GPU builders only, on the host it is an error.
enum DropReason : std::uint8_t { kKept = 0, kNotFinite = 1, kDegenerate = 2, kBadIndex = 3 };

/// @return false for NaN.
HIPRT_HD HIPRT_FORCE_INLINE bool is_within(const float* position, float limit) {
  bool within = true;
  for (unsigned axis = 0; axis < 3; ++axis) within = within && position[axis] > -limit && position[axis] < limit;
  return within;
}

inline constexpr float kNoLimit = std::numeric_limits<float>::infinity();

/// Degenerate: two corners at the same position.
HIPRT_HD HIPRT_FORCE_INLINE DropReason drop_reason(const float* a, const float* b, const float* c) {
  if (!is_within(a, kNoLimit) || !is_within(b, kNoLimit) || !is_within(c, kNoLimit)) return kNotFinite;
  return same_position(a, b) || same_position(b, c) || same_position(c, a) ? kDegenerate : kKept;
}

/// Degenerate: inverted.
HIPRT_HD HIPRT_FORCE_INLINE DropReason drop_reason(const Box& box) {
  if (!is_within(box.min, kNoLimit) || !is_within(box.max, kNoLimit)) return kNotFinite;
  bool ordered = true;
  for (unsigned axis = 0; axis < 3; ++axis) ordered = ordered && box.min[axis] <= box.max[axis];
  return ordered ? kKept : kDegenerate;
}

}  // namespace hiprt::build
