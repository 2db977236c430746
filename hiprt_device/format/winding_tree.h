#pragma once
/// The arrays of winding_number(). They are not part of a file: build::winding_arrays() makes them from one.

#include <hiprt_device/format/portability.h>

namespace hiprt {

/// A triangle in the order of its mesh.
struct WindingTriangle {
  float corner[3][3];
};

/// A node of the tree: a ball around its triangles, and their moments. Its descendants follow it.
struct WindingNode {
  double center[3];  ///< About the mean of the surface.
  double radius;     ///< No corner is farther from the center.
  double dipole[3];  ///< Sum of the triangles' areas times normals.
  double spread[6];  ///< Sum of (centroid - center) x (area times normal): xx, yy, zz, and yz, zx, xy with zy, xz, yx.
  double area;       ///< At least the sum of the triangles' areas.
  std::uint32_t next;   ///< The node after its last descendant.
  std::uint32_t first;  ///< Triangle.
  std::uint32_t count;  ///< Triangles.
  std::uint32_t unused;
};
static_assert(sizeof(WindingNode) == 128);

/// The arrays of a mesh, in the memory of the processor that asks. build::WindingArrays makes them.
struct WindingTree {
  const WindingNode* nodes = nullptr;
  const WindingTriangle* triangles = nullptr;
  std::uint32_t node_count = 0;  ///< 0: nothing encloses anything.
};

}  // namespace hiprt
