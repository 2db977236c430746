#pragma once
/// The geometries of a build in the memory of the processor that builds: one numbering of all primitives. Internal.

#include <hiprt_build/input/corners.h>
#include <hiprt_build/input/dropped_primitives.h>
#include <hiprt_device/format/buffer.h>

#include <array>
#include <cstdint>

namespace hiprt::build {

/// A mesh or custom primitives. Trivial, because shared memory of kernels holds it.
struct GeometryView {
  const std::byte* positions;              ///< Of a mesh.
  const std::byte* triangles;              ///< Of a mesh; nullptr: implicit triangles.
  const std::byte* boxes;                  ///< Of custom primitives; then the others are nullptr.
  std::uint32_t stride;                    ///< In bytes, of positions or boxes.
  std::uint32_t triangle_stride_or_upper;  ///< In bytes: of a mesh, or the offset of a box's upper corner.
  std::uint32_t position_count;
  std::uint32_t primitive_count;
  std::uint32_t first;  ///< Number of its first primitive among those of all geometries.
  std::uint32_t mask;
  std::uint32_t flags;  ///< GeometryRecord::flags
  bool given_pairs;     ///< The caller says which triangles share a leaf.

  HIPRT_HD static GeometryView of_mesh(const void* positions, std::uint32_t position_count, std::uint32_t stride,
                                       const void* triangles, std::uint32_t triangle_count,
                                       std::uint32_t triangle_stride) {
    return {static_cast<const std::byte*>(positions),
            static_cast<const std::byte*>(triangles),
            nullptr,
            stride,
            triangle_stride,
            position_count,
            triangle_count,
            0,
            0xffffffffu,
            0,
            false};
  }
  HIPRT_HD static GeometryView of_boxes(const void* boxes, std::uint32_t count, std::uint32_t stride,
                                        std::uint32_t upper, std::uint32_t type) {
    return {nullptr, nullptr,     static_cast<const std::byte*>(boxes), stride, upper, 0, count,
            0,       0xffffffffu, custom_geometry_flags(type),          false};
  }

  HIPRT_HD HIPRT_FORCE_INLINE bool is_custom() const { return boxes != nullptr; }
  /// @pre a mesh.
  HIPRT_HD HIPRT_FORCE_INLINE const float* position(std::uint32_t i) const {
    return reinterpret_cast<const float*>(positions + std::uint64_t{i} * stride);
  }
  /// The indices of a triangle. @pre a mesh.
  HIPRT_HD HIPRT_FORCE_INLINE std::array<std::uint32_t, 3> triangle(std::uint32_t i) const {
    if (triangles == nullptr) return {3 * i, 3 * i + 1, 3 * i + 2};
    const auto* index = reinterpret_cast<const std::uint32_t*>(triangles + std::uint64_t{i} * triangle_stride_or_upper);
    return {index[0], index[1], index[2]};
  }
  /// @pre a mesh. @param k 0 to 2.
  HIPRT_HD HIPRT_FORCE_INLINE const float* corner(std::uint32_t triangle, unsigned k) const {
    if (triangles == nullptr) return position(3 * triangle + k);
    return position(
        reinterpret_cast<const std::uint32_t*>(triangles + std::uint64_t{triangle} * triangle_stride_or_upper)[k]);
  }
  /// @pre custom primitives.
  HIPRT_HD HIPRT_FORCE_INLINE Box box(std::uint32_t i) const {
    const std::byte* lower = boxes + std::uint64_t{i} * stride;
    const auto *min = reinterpret_cast<const float*>(lower),
               *max = reinterpret_cast<const float*>(lower + triangle_stride_or_upper);
    return Box{{min[0], min[1], min[2]}, {max[0], max[1], max[2]}};
  }
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
  const float* position = mesh.corner(triangle, k);
  return Point{{position[0], position[1], position[2]}};
}

struct TriangleCorners {
  Point v[3];
};

/// @param corners are written unless an index is bad.
HIPRT_HD HIPRT_FORCE_INLINE DropReason load_triangle(const GeometryView& mesh, std::uint32_t triangle,
                                                     TriangleCorners& corners) {
  const std::array<std::uint32_t, 3> index = mesh.triangle(triangle);
  if (index[0] >= mesh.position_count || index[1] >= mesh.position_count || index[2] >= mesh.position_count)
    return kBadIndex;
  for (unsigned k = 0; k < 3; ++k) {
    const float* position = mesh.position(index[k]);
    for (unsigned axis = 0; axis < 3; ++axis) corners.v[k].x[axis] = position[axis];
  }
  return drop_reason(corners.v[0].x, corners.v[1].x, corners.v[2].x);
}

}  // namespace hiprt::build
