#pragma once
/// Which triangles become leaves, alone or in pairs. Internal.
///
/// Triangles of one mesh whose corners touch at the same positions and that run through their common edge in opposite
/// directions may share a leaf. Each triangle looks at its three neighbours wherever they are in the index buffer,
/// prefers the one whose common box saves most area, and two that prefer each other pair up; a few rounds of this
/// (handshake matching) leave few triangles single. The result does not depend on the number of threads.

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/steps/geometry.h>

namespace hiprt::build {

/// What became of the input's triangles.
struct GroupedTriangles {
  ScratchArray<TriangleGroup> groups;  ///< The first count ones are used; in the order of mesh and lower triangle.
  std::size_t count = 0;
  std::uint64_t pairs = 0;
  std::uint64_t dropped_not_finite = 0, dropped_degenerate = 0;
  std::vector<std::uint64_t> dropped;  ///< Per mesh.
};

/// @param pair_triangles false: every triangle alone.
GroupedTriangles group_triangles(CpuEngine& engine, const TriangleSoup& soup, bool pair_triangles);

}  // namespace hiprt::build
