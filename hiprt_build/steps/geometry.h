#pragma once
/// The meshes of a build as one numbering of triangles, and the groups of one or two that become leaves. Internal.

#include <hiprt_build/input.h>
#include <hiprt_build/steps/aabb.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hiprt::build {

/// Triangles of all meshes, numbered mesh by mesh.
struct TriangleSoup {
  std::span<const TriangleMesh> meshes;
  std::vector<std::uint64_t> first;  ///< Of mesh i; one more at the end: the number of all.

  std::uint64_t size() const { return first.back(); }
  const Position& corner(std::uint32_t mesh, std::uint32_t triangle, unsigned k) const {
    return meshes[mesh].positions[meshes[mesh].triangles[triangle][k]];
  }
};

inline Float4 to_float4(const Position& p) { return Float4{p[0], p[1], p[2], 0.0f}; }

/// One leaf: a triangle, or two that share an edge. Triangle numbers are within the mesh.
/// Stored corner k of a triangle is the mesh's corner (k + rotation) % 3; the shared edge is v1 v2 (see LeafInfo).
struct TriangleGroup {
  std::uint32_t triangle[2];  ///< The second is kInvalidId for a single triangle.
  std::uint32_t mesh : 28;
  std::uint32_t rotation0 : 2;
  std::uint32_t rotation1 : 2;

  bool is_pair() const { return triangle[1] != kInvalidId; }
  /// Corners v0, v1, v2, v3; v3 = v2 for a single triangle.
  std::array<Position, 4> vertices(const TriangleSoup& soup) const {
    std::array<Position, 4> v;
    for (unsigned k = 0; k < 3; ++k) v[k] = soup.corner(mesh, triangle[0], (k + rotation0) % 3);
    v[3] = is_pair() ? soup.corner(mesh, triangle[1], (1 + rotation1) % 3) : v[2];
    return v;
  }
};
static_assert(sizeof(TriangleGroup) == 12);

}  // namespace hiprt::build
