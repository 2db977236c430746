#pragma once
/// The geometries of a build in the memory of the processor that builds: one numbering of all primitives. Internal.

#include <hiprt_build/input/corners.h>
#include <hiprt_build/input/dropped_primitives.h>

#include <array>
#include <cstdint>

namespace hiprt::build {

/// A mesh or custom primitives.
struct GeometryView {
  const std::array<float, 3>* positions;
  const std::array<std::uint32_t, 3>* triangles;
  const Box* boxes;  ///< Of custom primitives; then the others are nullptr.
  std::uint32_t position_count;
  std::uint32_t primitive_count;
  std::uint32_t first;  ///< Number of its first primitive among those of all geometries.
  std::uint32_t mask;
  std::uint32_t flags;  ///< GeometryRecord::flags

  HIPRT_HD bool is_custom() const { return boxes != nullptr; }
};

/// All geometries. Primitives are numbered geometry by geometry, meshes before custom geometries.
struct GeometryTable {
  const GeometryView* geometries;
  std::uint32_t count;
  std::uint32_t primitive_count;  ///< Of all geometries.

  HIPRT_HD HIPRT_FORCE_INLINE const GeometryView& operator[](std::uint32_t geometry) const {
    return geometries[geometry];
  }

  /// @return the geometry of a primitive.
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t find(std::uint32_t primitive) const {
    std::uint32_t low = 0, high = count;
    while (high - low > 1) {
      const std::uint32_t middle = low + (high - low) / 2;
      (geometries[middle].first <= primitive ? low : high) = middle;
    }
    return low;
  }
};

HIPRT_HD HIPRT_FORCE_INLINE Point corner(const GeometryView& mesh, std::uint32_t triangle, unsigned k) {
  const std::array<float, 3>& position = mesh.positions[mesh.triangles[triangle][k]];
  return Point{{position[0], position[1], position[2]}};
}

struct TriangleCorners {
  Point v[3];
};

/// @param corners are written unless an index is bad.
HIPRT_HD HIPRT_FORCE_INLINE DropReason load_triangle(const GeometryView& mesh, std::uint32_t triangle,
                                                     TriangleCorners& corners) {
  const std::array<std::uint32_t, 3> index = mesh.triangles[triangle];
  if (index[0] >= mesh.position_count || index[1] >= mesh.position_count || index[2] >= mesh.position_count)
    return kBadIndex;
  for (unsigned k = 0; k < 3; ++k) {
    const std::array<float, 3> position = mesh.positions[index[k]];
    for (unsigned axis = 0; axis < 3; ++axis) corners.v[k].x[axis] = position[axis];
  }
  return drop_reason(corners.v[0].x, corners.v[1].x, corners.v[2].x);
}

}  // namespace hiprt::build
