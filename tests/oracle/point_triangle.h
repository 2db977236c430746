#pragma once
/// The exact squared distance of a point and a triangle, in rationals. Host only; no decision rounds.
///
/// The closest point of a triangle's plane counts if it lies in the triangle. Otherwise the closest of the edges does.
/// An edge's closest point is that of its line, moved to the nearer end if it lies beyond.

#include <tests/oracle/brute_force.h>
#include <tests/oracle/exact.h>

#include <span>

namespace hiprt::oracle {

using Rational3 = std::array<Rational, 3>;

namespace rational_detail {

inline Rational dot(const Rational3& a, const Rational3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Rational3 minus(const Rational3& a, const Rational3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Rational3 cross(const Rational3& a, const Rational3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline Rational to_edge(const Rational3& p, const Rational3& a, const Rational3& b) {
  const Rational3 edge = minus(b, a), from = minus(p, a), to = minus(p, b);
  const Rational ahead = dot(edge, from), length = dot(edge, edge);
  if (ahead <= 0) return dot(from, from);
  if (ahead >= length) return dot(to, to);
  return dot(from, from) - ahead * ahead / length;
}

}  // namespace rational_detail

/// The corners of a triangle in rationals.
using RationalCorners = std::array<Rational3, 3>;

inline Rational3 exact3(double x, double y, double z) { return {Rational(x), Rational(y), Rational(z)}; }
inline Rational3 exact3(const Position& p) { return exact3(p[0], p[1], p[2]); }
inline RationalCorners exact_corners(const Corners& c) { return {exact3(c.p0), exact3(c.p1), exact3(c.p2)}; }

/// @pre all finite.
inline Rational squared_distance(const Rational3& p, const RationalCorners& c) {
  using namespace rational_detail;
  const Rational3 normal = cross(minus(c[1], c[0]), minus(c[2], c[0]));
  const Rational area = dot(normal, normal);
  bool inside = area > 0;
  for (unsigned k = 0; k < 3 && inside; ++k)
    inside = dot(normal, cross(minus(c[(k + 1) % 3], c[k]), minus(p, c[k]))) >= 0;
  if (inside) {
    const Rational height = dot(normal, minus(p, c[0]));
    return height * height / area;
  }
  return std::min({to_edge(p, c[0], c[1]), to_edge(p, c[1], c[2]), to_edge(p, c[2], c[0])});
}

/// The largest distance of a corner from a point, rounded to double.
inline double reach(const Rational3& p, const RationalCorners& c) {
  Rational largest = 0;
  for (const Rational3& corner : c) {
    const Rational3 from = rational_detail::minus(p, corner);
    largest = std::max(largest, rational_detail::dot(from, from));
  }
  return std::sqrt(largest.get_d());
}

/// The exact closest triangle; of several at the same distance the lowest geometry, then the lowest primitive.
struct ExactNearest {
  bool found = false;
  std::uint32_t geometry = kInvalidId, primitive = kInvalidId;
  Rational squared;
};

/// Geometries that the mask hides are skipped, and triangles that builders drop.
inline ExactNearest nearest(std::span<const Mesh> meshes, const Rational3& p, std::uint32_t mask = 0xffffffffu) {
  ExactNearest best;
  for (std::uint32_t geometry = 0; geometry < meshes.size(); ++geometry) {
    const Mesh& mesh = meshes[geometry];
    if ((mesh.mask & mask) == 0) continue;
    for (std::uint32_t primitive = 0; primitive < mesh.triangles.size(); ++primitive) {
      const Corners c = corners(mesh, primitive);
      if (is_dropped(c)) continue;
      const Rational squared = squared_distance(p, exact_corners(c));
      if (!best.found || squared < best.squared) best = {true, geometry, primitive, squared};
    }
  }
  return best;
}

}  // namespace hiprt::oracle
