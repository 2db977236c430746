#pragma once
/// Corners of a leaf's triangles. Internal.

#include <hiprt_build/steps/box.h>

namespace hiprt::build {

struct Point {
  float x[3];
};

HIPRT_HD HIPRT_INLINE void grow(Box& box, const Point& point) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    box.min[axis] = point.x[axis] < box.min[axis] ? point.x[axis] : box.min[axis];
    box.max[axis] = point.x[axis] > box.max[axis] ? point.x[axis] : box.max[axis];
  }
}

/// Corners v0, v1, v2, v3 of a leaf's triangles, v0 v1 v2 and v1 v3 v2; v3 = v2 for a single one.
struct LeafCorners {
  Point v[4];
};

}  // namespace hiprt::build
