#pragma once
/// Parts of procedural meshes.

#include <tools/scene_io/mesh/mesh_import.h>

#include <glm/glm.hpp>

#include <cstdint>
#include <span>

namespace hiprt::bench {

using Point = glm::dvec3;

inline constexpr double kTurn = 6.283185307179586476925;

/// Adds a vertex. @return its number.
std::uint32_t add_vertex(tools::Mesh& mesh, const Point& p);

/// Adds two triangles per cell of a grid of columns x rows cells. The corners are the vertices from @p first, row by
/// row.
void add_grid_triangles(tools::Mesh& mesh, std::uint32_t first, std::uint32_t columns, std::uint32_t rows);

/// A ring of a tube.
struct Ring {
  Point center;
  double radius;
};

/// A tube with @p sides sides along two or more rings, which are perpendicular to its direction. Both ends are open.
void add_tube(tools::Mesh& mesh, std::span<const Ring> rings, std::uint32_t sides);

/// Two unit vectors that are perpendicular to a direction and to each other.
struct Frame {
  Point right, up;
  explicit Frame(const Point& direction);
};

}  // namespace hiprt::bench
