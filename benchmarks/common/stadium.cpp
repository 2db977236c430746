#include "stadium.h"

#include "mesh_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace hiprt::bench {
namespace {

/// Rows of seats around an oval field. Each row is a tread and a riser.
void add_terraces(tools::Mesh& mesh, std::uint32_t triangles) {
  constexpr std::uint32_t kSteps = 60;
  constexpr double kTread = 0.85, kRise = 0.5, kHalfLength = 149, kHalfWidth = 89;
  const std::uint32_t columns = std::max(8u, triangles / (2 * 2 * kSteps));
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (std::uint32_t row = 0; row <= 2 * kSteps; ++row) {
    const std::uint32_t step = row / 2;
    const double out = kTread * (step + row % 2), up = kRise * step;
    for (std::uint32_t column = 0; column <= columns; ++column) {
      const double angle = kTurn * (column % columns) / columns;
      add_vertex(mesh, {(kHalfLength + out) * std::cos(angle), up, (kHalfWidth + out) * std::sin(angle)});
    }
  }
  add_grid_triangles(mesh, first, columns, 2 * kSteps);
}

void add_field(tools::Mesh& mesh) {
  constexpr std::uint32_t kCells = 16;
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (std::uint32_t row = 0; row <= kCells; ++row)
    for (std::uint32_t column = 0; column <= kCells; ++column)
      add_vertex(mesh, {300.0 * column / kCells - 150.0, 0, 180.0 * row / kCells - 90.0});
  add_grid_triangles(mesh, first, kCells, kCells);
}

/// A cubic Bezier curve.
template <class P> P bezier(const std::array<P, 4>& p, double t) {
  const double s = 1 - t;
  return s * s * s * p[0] + 3 * s * s * t * p[1] + 3 * s * t * t * p[2] + t * t * t * p[3];
}

/// A profile (radius, height) of Bezier curves turned around y.
void add_lathe(tools::Mesh& mesh, const std::vector<std::array<glm::dvec2, 4>>& profile, std::uint32_t cells) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  const auto rows = static_cast<std::uint32_t>(profile.size()) * cells;
  for (std::uint32_t row = 0; row <= rows; ++row) {
    const std::uint32_t curve = std::min(row / cells, static_cast<std::uint32_t>(profile.size() - 1));
    const glm::dvec2 p = bezier(profile[curve], static_cast<double>(row - curve * cells) / cells);
    for (std::uint32_t column = 0; column <= 2 * cells; ++column) {
      const double angle = kTurn * (column % (2 * cells)) / (2 * cells);
      add_vertex(mesh, {p.x * std::cos(angle), p.y, p.x * std::sin(angle)});
    }
  }
  add_grid_triangles(mesh, first, 2 * cells, rows);
}

/// A tube along a Bezier curve.
void add_bent_tube(tools::Mesh& mesh, const std::array<Point, 4>& curve, double from, double to, std::uint32_t cells) {
  std::vector<Ring> rings;
  for (std::uint32_t i = 0; i <= cells; ++i) {
    const double t = static_cast<double>(i) / cells;
    rings.push_back({bezier(curve, t), from + (to - from) * t});
  }
  add_tube(mesh, rings, cells);
}

/// Body, lid, spout and handle, similar to Newell's teapot.
void add_teapot(tools::Mesh& mesh, std::uint32_t triangles) {
  // Rows times columns of the lathe are 6 * 2 cells^2, of the tubes 2 cells^2.
  const auto cells = std::max(4u, static_cast<std::uint32_t>(std::sqrt(triangles / 2.0 / 14.0)));
  const std::size_t first = mesh.positions.size();
  add_lathe(mesh,
            {{{{0, 0}, {0.6, 0}, {1.5, 0.05}, {1.5, 0.15}}},
             {{{1.5, 0.15}, {1.75, 0.5}, {2.0, 0.7}, {2.0, 1.1}}},
             {{{2.0, 1.1}, {2.0, 1.5}, {1.7, 2.0}, {1.5, 2.4}}},
             {{{1.5, 2.4}, {1.4, 2.55}, {1.35, 2.5}, {1.3, 2.4}}},
             {{{1.3, 2.4}, {1.1, 2.6}, {0.3, 2.55}, {0.2, 2.7}}},
             {{{0.2, 2.7}, {0.1, 2.85}, {0.6, 3.15}, {0.0, 3.15}}}},
            cells);
  add_bent_tube(mesh, {Point(1.7, 0.6, 0), Point(2.6, 0.6, 0), Point(2.3, 2.1, 0), Point(3.0, 2.4, 0)}, 0.42, 0.14,
                cells);
  add_bent_tube(mesh, {Point(-1.6, 2.0, 0), Point(-3.2, 2.2, 0), Point(-3.0, 0.8, 0), Point(-1.9, 0.6, 0)}, 0.13, 0.13,
                cells);
  constexpr float kScale = 0.2f / 3.15f;
  for (std::size_t i = first; i < mesh.positions.size(); ++i)
    for (float& x : mesh.positions[i]) x *= kScale;
}

}  // namespace

tools::Mesh stadium(std::uint32_t triangles) {
  tools::Mesh mesh;
  mesh.name = "stadium";
  add_terraces(mesh, triangles);
  add_field(mesh);
  add_teapot(mesh, triangles);
  return mesh;
}

tools::Camera stadium_camera() {
  tools::Camera camera;
  camera.eye = {0.42, 0.26, 0.55};
  camera.at = {0.0, 0.12, 0.0};
  camera.fov_degrees = 40;
  return camera;
}

}  // namespace hiprt::bench
