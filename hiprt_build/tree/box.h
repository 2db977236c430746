#pragma once
/// Boxes as host and device both compute with them. (aabb.h has the host's vector registers.) Internal.

#include <hiprt_device/format/node.h>

#include <limits>

namespace hiprt::build {

HIPRT_HD constexpr Box empty_box() {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  return Box{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
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

/// Half the centre: halved again so that sums and extents stay finite for every finite box.
HIPRT_HD constexpr float split_position(const Box& box, unsigned axis) {
  return 0.25f * box.min[axis] + 0.25f * box.max[axis];
}

}  // namespace hiprt::build
