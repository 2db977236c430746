#pragma once
/// Reasons why a refit cannot write the moved primitives of a built scene. Internal.

#include <hiprt_build/input/geometry.h>

namespace hiprt::build {

/// Why a leaf cannot hold its moved primitives.
enum class MoveFault : std::uint8_t {
  kNone,
  kNotFinite,
  kInverted,   ///< A custom primitive's box.
  kTooLarge,   ///< A coordinate is beyond what the layout holds.
  kComeApart,  ///< The two triangles of a leaf have lost their common edge.
};

/// A triangle in the order of a leaf.
struct StoredTriangle {
  const float* corner[3];

  /// @param triangle_id its byte.
  HIPRT_HD HIPRT_FORCE_INLINE StoredTriangle(const GeometryView& mesh, std::uint32_t triangle,
                                             std::uint32_t triangle_id) {
    const unsigned rotation = TriangleId::to_rotation(triangle_id);
    for (unsigned k = 0; k < 3; ++k) corner[k] = mesh.corner(triangle, (k + rotation) % 3);
  }
};

/// Triangle 0 or 1 of a triangle leaf. @pre it has it.
HIPRT_HD HIPRT_FORCE_INLINE StoredTriangle stored_triangle(const GeometryView& mesh, const LeafInfo& info,
                                                           unsigned which) {
  return StoredTriangle(mesh, info.primitive[which], info.triangle_ids >> (8 * which) & 0xffu);
}

/// @param limit that coordinates must stay below in magnitude; kNoLimit.
HIPRT_HD HIPRT_FORCE_INLINE MoveFault primitive_fault(const GeometryView& geometry, std::uint32_t primitive,
                                                      float limit) {
  const bool custom = geometry.is_custom();
  const Box box = custom ? geometry.box(primitive) : Box{};
  if (custom && drop_reason(box) == kDegenerate) return MoveFault::kInverted;
  for (unsigned k = 0; k < (custom ? 2u : 3u); ++k) {
    const float* position = !custom ? geometry.corner(primitive, k) : k == 0 ? box.min : box.max;
    if (!is_within(position, kNoLimit)) return MoveFault::kNotFinite;
    if (!is_within(position, limit)) return MoveFault::kTooLarge;
  }
  return MoveFault::kNone;
}

/// @pre indices are good.
HIPRT_HD HIPRT_FORCE_INLINE MoveFault leaf_fault(const GeometryView* geometries, const LeafInfo& info, float limit) {
  const GeometryView& geometry = geometries[info.geometry_and_flags & kGeometryMask];
  const MoveFault first = primitive_fault(geometry, info.primitive[0], limit);
  if (first != MoveFault::kNone || info.primitive[1] == kInvalidId) return first;
  const MoveFault second = primitive_fault(geometry, info.primitive[1], limit);
  if (second != MoveFault::kNone || geometry.is_custom()) return second;
  const StoredTriangle a = stored_triangle(geometry, info, 0), b = stored_triangle(geometry, info, 1);
  return same_position(a.corner[1], b.corner[0]) && same_position(a.corner[2], b.corner[2]) ? MoveFault::kNone
                                                                                            : MoveFault::kComeApart;
}

/// Whether a builder would keep the primitive. @pre indices are good.
HIPRT_HD HIPRT_FORCE_INLINE bool would_be_kept(const GeometryView& geometry, std::uint32_t primitive) {
  if (geometry.is_custom()) return drop_reason(geometry.box(primitive)) == kKept;
  return drop_reason(geometry.corner(primitive, 0), geometry.corner(primitive, 1), geometry.corner(primitive, 2)) ==
         kKept;
}

}  // namespace hiprt::build
