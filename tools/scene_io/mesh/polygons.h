#pragma once
/// Splits polygons into triangles.

#include <hiprt_build/error.h>
#include <hiprt_build/input.h>

#include <cstdint>
#include <span>
#include <vector>

namespace hiprt::tools {

/// Faces of any size, one after the other.
struct Polygons {
  std::vector<std::uint32_t> corners;  ///< Vertex numbers.
  std::vector<std::uint32_t> sizes;    ///< Corners of each face.
};

/// Splits every face of size n into n - 2 triangles with the face's orientation, in the order of the faces. Convex
/// faces become a fan around their first corner. Other faces are clipped ear by ear (Meisters 1975), projected along
/// the largest axis of their Newell normal (ear_clipper.h). Faces with a corner that is not finite there are fans, too.
/// Faces with fewer than three corners are counted in @p skipped.
/// @return kCancelled when interrupted() became true, kInvalidInput for a corner past the positions, with the face's
/// number.
build::Result<std::vector<build::Triangle>> triangulate(std::span<const build::Position> positions,
                                                        const Polygons& polygons, std::uint64_t& skipped);

}  // namespace hiprt::tools
