#pragma once
/// Moving meshes: the same triangles with other vertex positions.

#include <tests/oracle/mesh.h>
#include <tests/oracle/random.h>

#include <array>
#include <cmath>

namespace hiprt::oracle {

/// Centre and half the largest extent of a mesh's finite vertices.
struct Extent {
  Double3 center{};
  double radius = 0;
};
inline Extent extent(const Mesh& mesh) {
  Extent result;
  for (std::size_t k = 0; k < 3; ++k) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Position& p : mesh.positions)
      if (std::isfinite(p[k])) low = std::min(low, double{p[k]}), high = std::max(high, double{p[k]});
    result.center[k] = 0.5 * (low + high);
    result.radius = std::max(result.radius, 0.5 * (high - low));
  }
  return result;
}

/// @return the mesh with p -> function(p), p relative to the centre in units of the radius.
template <class Function> Mesh moved(Mesh mesh, const Function& function) {
  const Extent e = extent(mesh);
  for (Position& p : mesh.positions) {
    Double3 at{};
    for (std::size_t k = 0; k < 3; ++k) at[k] = (double{p[k]} - e.center[k]) / e.radius;
    at = function(at);
    for (std::size_t k = 0; k < 3; ++k) at[k] = e.center[k] + at[k] * e.radius;
    p = rounded(at);
  }
  return mesh;
}

/// Turned around the z axis, by @p amount turns between the middle and an end.
inline Mesh twisted(const Mesh& mesh, double amount) {
  return moved(mesh, [&](const Double3& p) {
    const double angle = 2 * std::numbers::pi * amount * p[2], c = std::cos(angle), s = std::sin(angle);
    return Double3{c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]};
  });
}

/// Two waves along x, @p amount high.
inline Mesh waved(const Mesh& mesh, double amount) {
  return moved(mesh, [&](const Double3& p) {
    return Double3{p[0], p[1], p[2] + amount * std::sin(2 * std::numbers::pi * p[0])};
  });
}

/// Every vertex anywhere in a cube of half the edge @p amount around where it was.
inline Mesh shaken(const Mesh& mesh, double amount, std::uint64_t seed) {
  Random random(seed);
  return moved(mesh, [&](const Double3& p) {
    const Position d = random.in_cube(amount);
    return Double3{p[0] + double{d[0]}, p[1] + double{d[1]}, p[2] + double{d[2]}};
  });
}

/// Triangles with three vertices of their own each, in the same order.
inline Mesh unshared(const Mesh& mesh) {
  Mesh result;
  for (const Triangle& t : mesh.triangles)
    append(result, mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]);
  return result;
}

/// Triangles fly from the centre, each as a whole: @p amount of their distance on average, from 0 to twice that.
/// @pre unshared().
inline Mesh exploded(Mesh mesh, double amount, std::uint64_t seed) {
  Random random(seed);
  const Extent e = extent(mesh);
  for (const Triangle& t : mesh.triangles) {
    const double s = random.uniform(0, 2 * amount);
    for (std::size_t k = 0; k < 3; ++k) {
      double middle = 0;
      for (const std::uint32_t v : t) middle += double{mesh.positions[v][k]} / 3;
      const auto step = static_cast<float>(s * (middle - e.center[k]));
      for (const std::uint32_t v : t) mesh.positions[v][k] += step;
    }
  }
  return mesh;
}

/// @p part of the triangles fly off, up to @p distance radii, each as a whole. @pre unshared().
inline Mesh scattered(Mesh mesh, double part, double distance, std::uint64_t seed) {
  Random random(seed);
  const double reach = distance * extent(mesh).radius;
  for (const Triangle& t : mesh.triangles) {
    if (random.unit() >= part) continue;
    const Position step = random.in_cube(reach);
    for (const std::uint32_t v : t)
      for (std::size_t k = 0; k < 3; ++k) mesh.positions[v][k] += step[k];
  }
  return mesh;
}

}  // namespace hiprt::oracle
