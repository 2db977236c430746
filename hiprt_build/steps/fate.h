#pragma once
/// Which primitives of the input are built. Internal.

#include <hiprt_build/input.h>

#include <cmath>
#include <cstdint>

namespace hiprt::build {

/// What becomes of a primitive (input.h says why some are dropped).
enum Fate : std::uint8_t { kKept = 0, kNotFinite = 1, kDegenerate = 2 };

/// @pre the triangle's indices are below positions.size().
inline Fate triangle_fate(const TriangleMesh& mesh, std::size_t triangle) {
  const Position& a = mesh.positions[mesh.triangles[triangle][0]];
  const Position& b = mesh.positions[mesh.triangles[triangle][1]];
  const Position& c = mesh.positions[mesh.triangles[triangle][2]];
  bool finite = true;
  for (unsigned axis = 0; axis < 3; ++axis)
    finite = finite && std::isfinite(a[axis]) && std::isfinite(b[axis]) && std::isfinite(c[axis]);
  return !finite ? kNotFinite : a == b || b == c || c == a ? kDegenerate : kKept;
}

/// Of a custom primitive.
inline Fate box_fate(const Box& box) {
  bool finite = true, ordered = true;
  for (unsigned axis = 0; axis < 3; ++axis) {
    finite = finite && std::isfinite(box.min[axis]) && std::isfinite(box.max[axis]);
    ordered = ordered && box.min[axis] <= box.max[axis];
  }
  return !finite ? kNotFinite : !ordered ? kDegenerate : kKept;
}

}  // namespace hiprt::build
