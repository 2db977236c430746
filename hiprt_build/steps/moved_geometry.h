#pragma once
/// Where the primitives of a built scene are now, and what stands in the way of writing that into its file. Internal.

#include <hiprt_build/steps/fate.h>

namespace hiprt::build {

/// A mesh, or custom primitives, in memory of the host or the device.
struct MovedGeometry {
  const float* positions = nullptr;          ///< Three per vertex.
  const std::uint32_t* triangles = nullptr;  ///< Three vertices per triangle.
  const Box* boxes = nullptr;                ///< Of custom primitives; of meshes null.

  HIPRT_HD HIPRT_INLINE bool is_custom() const { return boxes != nullptr; }
  /// @pre a mesh. @param k 0 to 2.
  HIPRT_HD HIPRT_INLINE const float* corner(std::uint32_t triangle, unsigned k) const {
    return positions + std::uint64_t{3} * triangles[std::uint64_t{3} * triangle + k];
  }
};

/// Why a moved primitive has no place in its file.
enum class MoveFault : std::uint8_t {
  kNone,
  kNotFinite,  ///< It is in the tree, and is not finite now.
  kInverted,   ///< It is a custom primitive in the tree, and its box is inverted now.
  kTooLarge,   ///< It is in the tree, and a coordinate is beyond what the layout holds.
  kDropped,    ///< It is not in the tree, but now it would be.
};

/// @pre a mesh: its indices are good. @param in_tree whether the file's primitive map names a leaf.
/// @param limit that coordinates must stay below in magnitude; kNoLimit.
HIPRT_HD HIPRT_INLINE MoveFault move_fault(const MovedGeometry& geometry, std::uint32_t primitive, bool in_tree,
                                           float limit) {
  const bool custom = geometry.is_custom();
  const float* p[3];
  for (unsigned k = 0; k < 3; ++k) p[k] = custom ? geometry.boxes[primitive].min : geometry.corner(primitive, k);
  if (custom) p[1] = geometry.boxes[primitive].max;
  const Fate fate = custom ? box_fate(geometry.boxes[primitive]) : triangle_fate(p[0], p[1], p[2]);
  if (!in_tree) return fate == kKept ? MoveFault::kDropped : MoveFault::kNone;
  if (fate == kNotFinite) return MoveFault::kNotFinite;
  if (custom && fate == kDegenerate) return MoveFault::kInverted;
  for (const float* position : p)
    if (!is_within(position, limit)) return MoveFault::kTooLarge;
  return MoveFault::kNone;
}

}  // namespace hiprt::build
