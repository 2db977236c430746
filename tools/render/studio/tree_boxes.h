#pragma once
/// The boxes of one level of a tree as a triangle mesh.

#include <hiprt_build/build.h>
#include <hiprt_build/error.h>
#include <hiprt_build/format/view.h>

#include <cstddef>
#include <vector>

namespace hiprt::tools {

/// Boxes in the scene's space: those of instances' objects are parallelepipeds there.
struct TreeBoxes {
  std::vector<build::Position> corners;    ///< 8 per box; bits 0, 1, 2 of the number say at which end of x, y, z.
  std::vector<build::Triangle> triangles;  ///< 12 per box, two per side: corner 0 of each is a corner of the side, its
                                           ///< edges are edges of the side.

  std::size_t count() const { return corners.size() / kCorners; }
  static std::size_t box_of_triangle(std::size_t triangle) { return triangle / kTriangles; }

  static constexpr std::size_t kCorners = 8, kTriangles = 12;
};

/// Most boxes of a picture.
inline constexpr std::size_t kMostTreeBoxes = std::size_t{1} << 20;

/// The boxes @p level levels below the scene's box, and the boxes of leaves above that level. 0: the scene's box. 1:
/// the boxes of the root's children, and so on. Below the box of an instance come the boxes of its object's children.
/// @param time of moving instances.
/// @pre validate() accepted the file.
/// @return kTooLarge with the level if there are more than kMostTreeBoxes; kInvalidInput without any box.
build::Result<TreeBoxes> boxes_of_level(const BufferView& file, unsigned level, float time);

}  // namespace hiprt::tools
