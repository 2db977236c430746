#pragma once
/// The triangles of a BVH file, as a mesh for other libraries.

#include <hiprt_build/format/view.h>
#include <hiprt_build/input.h>

#include <vector>

namespace hiprt::bench {

/// Corners of all triangles of a file without instances, numbered over all geometries: triangle i has the corners
/// 3 i, 3 i + 1 and 3 i + 2. Triangles that no leaf has (dropped, or custom primitives) have NaN corners.
std::vector<build::Position> file_triangles(const BufferView& file);

}  // namespace hiprt::bench
