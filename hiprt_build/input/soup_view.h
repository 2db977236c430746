#pragma once
/// The geometries of a build as kernels see them: one numbering of primitives, and leaves of one or two of them. (The
/// host's is geometry.h.) Internal.

#include <hiprt_build/input/corners.h>
#include <hiprt_build/input/dropped_primitives.h>

#include <array>
#include <cstdint>

namespace hiprt::build {

/// A mesh or custom primitives, in the memory of the processor that builds.
struct GeometryView {
  const std::array<float, 3>* positions;
  const std::array<std::uint32_t, 3>* triangles;
  const Box* boxes;  ///< Of custom primitives; then the others are nullptr.
  std::uint32_t positions_count;
  std::uint32_t primitives;
  std::uint32_t first;  ///< Of its primitives in the numbering of all.
  std::uint32_t mask;
  std::uint32_t flags;  ///< GeometryRecord::flags

  HIPRT_HD bool is_custom() const { return boxes != nullptr; }
};

struct SoupView {
  const GeometryView* geometries;
  std::uint32_t count;
  std::uint32_t primitives;  ///< Of all geometries.

  /// The geometry of a primitive.
  HIPRT_HD HIPRT_INLINE std::uint32_t find(std::uint32_t primitive) const {
    std::uint32_t low = 0, high = count;
    while (high - low > 1) {
      const std::uint32_t middle = low + (high - low) / 2;
      (geometries[middle].first <= primitive ? low : high) = middle;
    }
    return low;
  }
};

HIPRT_HD HIPRT_INLINE Point corner(const GeometryView& mesh, std::uint32_t triangle, unsigned k) {
  const std::array<float, 3>& position = mesh.positions[mesh.triangles[triangle][k]];
  return Point{{position[0], position[1], position[2]}};
}

struct TriangleCorners {
  Point v[3];
};

/// @param corners are written unless an index is bad.
HIPRT_HD HIPRT_INLINE Fate load_triangle(const GeometryView& mesh, std::uint32_t triangle, TriangleCorners& corners) {
  const std::array<std::uint32_t, 3> index = mesh.triangles[triangle];
  if (index[0] >= mesh.positions_count || index[1] >= mesh.positions_count || index[2] >= mesh.positions_count)
    return kBadIndex;
  for (unsigned k = 0; k < 3; ++k) {
    const std::array<float, 3> position = mesh.positions[index[k]];
    for (unsigned axis = 0; axis < 3; ++axis) corners.v[k].x[axis] = position[axis];
  }
  return triangle_fate(corners.v[0].x, corners.v[1].x, corners.v[2].x);
}

/// A leaf's primitives: the lower one has a number of its own, this is the rest. Rotations as PrimitiveGroup.
struct PackedGroup {
  static constexpr std::uint32_t kNone = 0xffffffffu;
  static constexpr std::uint32_t kCustom = 3;
  static constexpr std::uint32_t kMaxDistance = (1u << 28) - 2;

  std::uint32_t bits;

  HIPRT_HD static PackedGroup none() { return PackedGroup{kNone}; }
  /// @param distance of the second primitive's number from the first's; 0: there is none.
  HIPRT_HD static PackedGroup make(std::uint32_t distance, std::uint32_t rotation0, std::uint32_t rotation1) {
    return PackedGroup{distance << 4 | rotation1 << 2 | rotation0};
  }
  HIPRT_HD bool exists() const { return bits != kNone; }
  HIPRT_HD bool is_pair() const { return bits >> 4 != 0; }
  HIPRT_HD bool is_custom() const { return rotation0() == kCustom; }
  HIPRT_HD std::uint32_t distance() const { return bits >> 4; }
  HIPRT_HD std::uint32_t rotation0() const { return bits & 3u; }
  HIPRT_HD std::uint32_t rotation1() const { return bits >> 2 & 3u; }
};

/// @param first the lower triangle, in its mesh.
HIPRT_HD HIPRT_INLINE LeafCorners leaf_corners(const GeometryView& mesh, std::uint32_t first, PackedGroup group) {
  LeafCorners corners;
  for (unsigned k = 0; k < 3; ++k) corners.v[k] = corner(mesh, first, (k + group.rotation0()) % 3);
  corners.v[3] = group.is_pair() ? corner(mesh, first + group.distance(), (1 + group.rotation1()) % 3) : corners.v[2];
  return corners;
}

/// Of a leaf.
HIPRT_HD HIPRT_INLINE Box group_box(const GeometryView& geometry, std::uint32_t first, PackedGroup group) {
  if (geometry.is_custom()) {
    const Box box = geometry.boxes[first];
    return group.is_pair() ? unite(box, geometry.boxes[first + group.distance()]) : box;
  }
  const LeafCorners corners = leaf_corners(geometry, first, group);
  Box box = empty_box();
  for (const Point& v : corners.v) grow(box, v);
  return box;
}

/// A leaf before it has its place in the tree.
struct alignas(32) LeafReference {
  Box box;
  PackedGroup group;
  std::uint32_t primitive;  ///< The lower one, in the numbering of all.
};
static_assert(sizeof(LeafReference) == 32);

}  // namespace hiprt::build
