#include <tools/scene_io/mesh/polygons.h>

#include <tools/base/interrupt.h>

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

/// Clips ears off one face. Time grows with the square of its size, because each corner's triangle is tested against
/// each other corner once. Corners that were outside stay outside. A corner that was inside blocks the ear until it is
/// clipped. A corner's triangle changes only when a neighbour is clipped.
class EarClipper {
 public:
  EarClipper(std::span<const Point> points, std::span<const std::uint32_t> corners)
      : points_(points), corners_(corners), ring_(corners.size()) {
    const auto n = static_cast<std::uint32_t>(ring_.size());
    for (std::uint32_t i = 0; i < n; ++i) ring_[i] = {(i + n - 1) % n, (i + 1) % n, 0, true};
  }

  /// Ends early when interrupted.
  void run(std::vector<build::Triangle>& triangles) {
    for (std::size_t left = ring_.size(); left > 3 && !interrupted(); --left) {
      std::size_t ear = 0;
      while (ear < ring_.size() && !is_ear(ear)) ++ear;
      // A face that crosses itself may have no ear; any corner will do then.
      clip(ear < ring_.size() ? ear : first(), triangles);
    }
    const std::uint32_t a = first(), b = ring_[a].after, c = ring_[b].after;
    triangles.push_back({corners_[a], corners_[b], corners_[c]});
  }

 private:
  struct Corner {
    std::uint32_t before, after;  ///< Its remaining neighbours.
    std::uint32_t outside;        ///< Corners below this number are clipped, or outside of its triangle.
    bool alive;
  };

  /// The first remaining corner.
  std::uint32_t first() const {
    std::uint32_t at = 0;
    while (!ring_[at].alive) ++at;
    return at;
  }

  /// @return whether the remaining polygon is convex at this corner, and no other corner is inside its triangle.
  bool is_ear(std::size_t at) {
    Corner& corner = ring_[at];
    if (!corner.alive) return false;
    const Point &a = points_[corner.before], &b = points_[at], &c = points_[corner.after];
    if (area2(a, b, c) <= 0) return false;
    for (; corner.outside < ring_.size(); ++corner.outside) {
      const Point& p = points_[corner.outside];
      if (!ring_[corner.outside].alive || p == a || p == b || p == c) continue;
      if (area2(a, b, p) >= 0 && area2(b, c, p) >= 0 && area2(c, a, p) >= 0) return false;
    }
    return true;
  }

  void clip(std::size_t at, std::vector<build::Triangle>& triangles) {
    Corner& corner = ring_[at];
    triangles.push_back({corners_[corner.before], corners_[at], corners_[corner.after]});
    corner.alive = false;
    ring_[corner.before].after = corner.after;
    ring_[corner.after].before = corner.before;
    ring_[corner.before].outside = ring_[corner.after].outside = 0;
  }

  std::span<const Point> points_;
  std::span<const std::uint32_t> corners_;
  std::vector<Corner> ring_;
};

void split_face(std::span<const build::Position> positions, std::span<const std::uint32_t> corners,
                std::vector<build::Triangle>& triangles) {
  if (corners.size() > 3) {
    const std::vector<Point> points = project(positions, corners);
    if (!convex(points)) return EarClipper(points, corners).run(triangles);
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
    if (interrupted()) return cancelled();
  }
  return triangles;
}

}  // namespace hiprt::tools
