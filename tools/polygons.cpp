#include "polygons.h"

#include "mesh_formats.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace hiprt::tools {
namespace {

using Point = std::array<double, 2>;

/// Twice the signed area of a triangle.
double area2(const Point& a, const Point& b, const Point& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// Projects a face so that it runs counter-clockwise.
std::vector<Point> project(std::span<const build::Position> positions, std::span<const std::uint32_t> corners) {
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
  std::vector<Point> points;
  points.reserve(corners.size());
  for (const std::uint32_t corner : corners) points.push_back({positions[corner][u], positions[corner][v]});
  return points;
}

bool convex(std::span<const Point> points) {
  const std::size_t n = points.size();
  for (std::size_t i = 0; i < n; ++i)
    if (area2(points[i], points[(i + 1) % n], points[(i + 2) % n]) < 0) return false;
  return true;
}

/// Is corner @p at of the remaining polygon @p ring an ear: convex, and no other corner in its triangle?
bool is_ear(std::span<const Point> points, std::span<const std::uint32_t> ring, std::size_t at) {
  const std::size_t n = ring.size();
  const std::size_t before = (at + n - 1) % n, after = (at + 1) % n;
  const Point &a = points[ring[before]], &b = points[ring[at]], &c = points[ring[after]];
  if (area2(a, b, c) <= 0) return false;
  for (std::size_t i = 0; i < n; ++i) {
    const Point& p = points[ring[i]];
    if (i == before || i == at || i == after || p == a || p == b || p == c) continue;
    if (area2(a, b, p) >= 0 && area2(b, c, p) >= 0 && area2(c, a, p) >= 0) return false;
  }
  return true;
}

void clip_ears(std::span<const Point> points, std::span<const std::uint32_t> corners,
               std::vector<build::Triangle>& triangles) {
  std::vector<std::uint32_t> ring(corners.size());
  for (std::uint32_t i = 0; i < ring.size(); ++i) ring[i] = i;
  while (ring.size() > 3) {
    std::size_t ear = 0;
    while (ear < ring.size() && !is_ear(points, ring, ear)) ++ear;
    // A face that crosses itself may have no ear; any corner will do then.
    if (ear == ring.size()) ear = 0;
    const std::size_t n = ring.size();
    triangles.push_back({corners[ring[(ear + n - 1) % n]], corners[ring[ear]], corners[ring[(ear + 1) % n]]});
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  triangles.push_back({corners[ring[0]], corners[ring[1]], corners[ring[2]]});
}

void split_face(std::span<const build::Position> positions, std::span<const std::uint32_t> corners,
                std::vector<build::Triangle>& triangles) {
  if (corners.size() > 3) {
    const std::vector<Point> points = project(positions, corners);
    if (!convex(points)) return clip_ears(points, corners, triangles);
  }
  for (std::size_t i = 2; i < corners.size(); ++i) triangles.push_back({corners[0], corners[i - 1], corners[i]});
}

build::Result<void> check_face(std::span<const std::uint32_t> corners, std::size_t vertices, std::size_t face) {
  if (corners.size() > kMaxPolygonSize)
    return invalid_input("face " + std::to_string(face) + " has " + std::to_string(corners.size()) +
                         " corners, the limit is " + std::to_string(kMaxPolygonSize));
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
  }
  return triangles;
}

}  // namespace hiprt::tools
