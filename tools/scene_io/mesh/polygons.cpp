#include <tools/scene_io/mesh/polygons.h>

#include <tools/base/interrupt.h>
#include <tools/scene_io/mesh/ear_clipper.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace hiprt::tools {
namespace {

/// Projects a face so that it runs counter-clockwise.
std::vector<PlanePoint> project(std::span<const build::Position> positions, std::span<const std::uint32_t> corners) {
  std::array<double, 3> normal{};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto& p = positions[corners[i]];
    const auto& q = positions[corners[(i + 1) % corners.size()]];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
      normal[axis] += (double{p[u]} - q[u]) * (double{p[v]} + q[v]);
    }
  }
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (std::abs(normal[k]) > std::abs(normal[axis])) axis = k;
  std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(u, v);
  std::vector<PlanePoint> points;
  points.reserve(corners.size());
  for (const std::uint32_t corner : corners) points.push_back({positions[corner][u], positions[corner][v]});
  return points;
}

bool is_finite(std::span<const PlanePoint> points) {
  return std::all_of(points.begin(), points.end(),
                     [](const PlanePoint& p) { return std::isfinite(p[0]) && std::isfinite(p[1]); });
}

bool convex(std::span<const PlanePoint> points) {
  const std::size_t n = points.size();
  for (std::size_t i = 0; i < n; ++i)
    if (area2(points[i], points[(i + 1) % n], points[(i + 2) % n]) < 0) return false;
  return true;
}

void split_face(std::span<const build::Position> positions, std::span<const std::uint32_t> corners,
                std::vector<build::Triangle>& triangles) {
  if (corners.size() > 3) {
    const std::vector<PlanePoint> points = project(positions, corners);
    if (is_finite(points) && !convex(points)) return EarClipper(points, corners).run(triangles);
  }
  for (std::size_t i = 2; i < corners.size(); ++i) triangles.push_back({corners[0], corners[i - 1], corners[i]});
}

build::Result<void> check_face(std::span<const std::uint32_t> corners, std::size_t vertices, std::size_t face) {
  for (const std::uint32_t corner : corners)
    if (corner >= vertices)
      return invalid_input("face " + std::to_string(face) + " uses vertex " + std::to_string(corner) + ", but only " +
                           std::to_string(vertices) + " vertices are there (both counted from 0)");
  return {};
}

}  // namespace

build::Result<std::vector<build::Triangle>> triangulate(std::span<const build::Position> positions,
                                                        const Polygons& polygons, std::uint64_t& skipped) {
  std::vector<build::Triangle> triangles;
  triangles.reserve(polygons.corners.size() - std::min(polygons.corners.size(), 2 * polygons.sizes.size()));
  const std::span<const std::uint32_t> all(polygons.corners);
  std::size_t first = 0;
  for (std::size_t face = 0; face < polygons.sizes.size(); ++face) {
    const auto corners = all.subspan(first, polygons.sizes[face]);
    first += corners.size();
    if (auto checked = check_face(corners, positions.size(), face); !checked) return tl::unexpected(checked.error());
    if (corners.size() < 3) ++skipped;
    split_face(positions, corners, triangles);
    if (interrupted()) return cancelled();
  }
  return triangles;
}

}  // namespace hiprt::tools
