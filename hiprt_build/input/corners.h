#pragma once
/// Corners of a leaf's triangles. Internal.

#include <hiprt_build/tree/box.h>

namespace hiprt::build {

struct Point {
  float x[3];
};

HIPRT_HD HIPRT_FORCE_INLINE void grow(Box& box, const Point& point) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    box.min[axis] = point.x[axis] < box.min[axis] ? point.x[axis] : box.min[axis];
    box.max[axis] = point.x[axis] > box.max[axis] ? point.x[axis] : box.max[axis];
  }
}

/// @return split_position() on all axes.
HIPRT_HD HIPRT_FORCE_INLINE Point split_point(const Box& box) {
  return Point{{split_position(box, 0), split_position(box, 1), split_position(box, 2)}};
}

/// Corners v0, v1, v2, v3 of a leaf's triangles, v0 v1 v2 and v1 v3 v2; v3 = v2 for a single one.
struct LeafCorners {
  Point v[4];
};

}  // namespace hiprt::build
