#include "mesh_parts.h"

#include <hiprt_device/math/vec_functions.h>
#include <cmath>

namespace hiprt::bench {

std::uint32_t add_vertex(tools::Mesh& mesh, const Point& p) {
  mesh.positions.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
  return static_cast<std::uint32_t>(mesh.positions.size() - 1);
}

void add_grid_triangles(tools::Mesh& mesh, std::uint32_t first, std::uint32_t columns, std::uint32_t rows) {
  for (std::uint32_t row = 0; row < rows; ++row)
    for (std::uint32_t column = 0; column < columns; ++column) {
      const std::uint32_t a = first + row * (columns + 1) + column, b = a + columns + 1;
      mesh.triangles.push_back({a, b, a + 1});
      mesh.triangles.push_back({a + 1, b, b + 1});
    }
}

Frame::Frame(const Point& direction) {
  const Point d = glm::normalize(direction);
  const Point other = std::fabs(d.y) < 0.9 ? Point(0, 1, 0) : Point(1, 0, 0);
  right = glm::normalize(glm::cross(other, d));
  up = glm::cross(d, right);
}

void add_tube(tools::Mesh& mesh, std::span<const Ring> rings, std::uint32_t sides) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  const Frame frame(rings.back().center - rings.front().center);
  for (const Ring& ring : rings)
    for (std::uint32_t side = 0; side <= sides; ++side) {
      const double angle = kTurn * (side % sides) / sides;
      add_vertex(mesh, ring.center + ring.radius * (std::cos(angle) * frame.right + std::sin(angle) * frame.up));
    }
  add_grid_triangles(mesh, first, sides, static_cast<std::uint32_t>(rings.size() - 1));
}

}  // namespace hiprt::bench
