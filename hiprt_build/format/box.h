#pragma once
/// Boxes on host and device: growing, comparing, and finding the wrong plane. Internal.

#include <hiprt_device/format/node.h>

#include <limits>

namespace hiprt::format_detail {

/// min = +inf, max = -inf: the neutral element of grow(), and the box of an absent child.
HIPRT_HD constexpr Box empty_box() {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  return {{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
}

HIPRT_HD inline float side_of(const Box& box, unsigned side, unsigned axis) {
  return side == 0 ? box.min[axis] : box.max[axis];
}

HIPRT_HD inline bool is_finite(float x) { return x - x == 0.0f; }

/// Planes of a box are numbered side * 3 + axis (0-5); 6 stands for none.
inline constexpr unsigned kNoPlane = 6;

/// @return the first plane that is not finite, or exceeds its finite opposite.
HIPRT_HD inline unsigned first_bad_plane(const Box& box) {
  for (unsigned plane = 0; plane < 6; ++plane) {
    const bool inverted = box.min[plane % 3] > box.max[plane % 3];
    if (!is_finite(side_of(box, plane / 3, plane % 3)) ||
        (inverted && is_finite(side_of(box, 1 - plane / 3, plane % 3))))
      return plane;
  }
  return kNoPlane;
}

/// The same, but min = -inf and max = +inf are allowed.
inline unsigned first_bad_plane_unbounded(Box box) {
  constexpr float kMax = std::numeric_limits<float>::max(), kInfinity = std::numeric_limits<float>::infinity();
  for (unsigned axis = 0; axis < 3; ++axis) {
    if (box.min[axis] == -kInfinity) box.min[axis] = -kMax;
    if (box.max[axis] == kInfinity) box.max[axis] = kMax;
  }
  return first_bad_plane(box);
}

/// @return the first plane in which the boxes differ.
inline unsigned first_different_plane(const Box& a, const Box& b) {
  for (unsigned plane = 0; plane < 6; ++plane)
    if (side_of(a, plane / 3, plane % 3) != side_of(b, plane / 3, plane % 3)) return plane;
  return kNoPlane;
}

/// @return the first plane of @p inner outside @p outer. A NaN is outside.
HIPRT_HD inline unsigned first_plane_outside(const Box& inner, const Box& outer) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    if (!(outer.min[axis] <= inner.min[axis])) return axis;
    if (!(inner.max[axis] <= outer.max[axis])) return 3 + axis;
  }
  return kNoPlane;
}

HIPRT_HD constexpr void grow(Box& box, const Box& other) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    box.min[axis] = other.min[axis] < box.min[axis] ? other.min[axis] : box.min[axis];
    box.max[axis] = other.max[axis] > box.max[axis] ? other.max[axis] : box.max[axis];
  }
}

HIPRT_HD constexpr Box unite(Box a, const Box& b) {
  grow(a, b);
  return a;
}

/// Half the surface area of a box with these edges. Sums of it are finite up to coordinates of 2^62.
HIPRT_HD constexpr float half_area(float x, float y, float z) { return x * (y + z) + y * z; }

/// @pre the box is not empty. NaN where edges overflow and others are 0.
HIPRT_HD constexpr float half_area(const Box& box) {
  return half_area(box.max[0] - box.min[0], box.max[1] - box.min[1], box.max[2] - box.min[2]);
}

/// @return the common part, or the empty box.
inline Box intersection(const Box& a, const Box& b) {
  Box common{};
  for (unsigned axis = 0; axis < 3; ++axis) {
    common.min[axis] = a.min[axis] < b.min[axis] ? b.min[axis] : a.min[axis];
    common.max[axis] = a.max[axis] < b.max[axis] ? a.max[axis] : b.max[axis];
    if (!(common.min[axis] <= common.max[axis])) return empty_box();
  }
  return common;
}

}  // namespace hiprt::format_detail
