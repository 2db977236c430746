#pragma once
/// A triangle mesh that owns its arrays, and what tests do to whole meshes.

#include <hiprt_build/input.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace hiprt::oracle {

using build::Position;
using build::Triangle;
using Double3 = std::array<double, 3>;

struct Mesh {
  std::vector<Position> positions;
  std::vector<Triangle> triangles;
  std::uint32_t mask = 0xffffffffu;

  build::TriangleMesh view() const { return {positions, triangles, mask}; }
};

inline std::vector<build::TriangleMesh> views(const std::vector<Mesh>& meshes) {
  std::vector<build::TriangleMesh> result;
  result.reserve(meshes.size());
  for (const Mesh& mesh : meshes) result.push_back(mesh.view());
  return result;
}

inline Position rounded(const Double3& p) {
  return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
}

/// @return the mesh with p -> p * scale + offset, computed in double and rounded once.
inline Mesh placed(Mesh mesh, double scale, const Double3& offset = {0, 0, 0}) {
  for (Position& p : mesh.positions)
    p = rounded({p[0] * scale + offset[0], p[1] * scale + offset[1], p[2] * scale + offset[2]});
  return mesh;
}

/// Appends a copy of @p part; its vertices are not shared with those of @p mesh.
inline void append(Mesh& mesh, const Mesh& part) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), part.positions.begin(), part.positions.end());
  for (const Triangle& t : part.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

/// Appends one triangle with new vertices.
inline void append(Mesh& mesh, const Position& a, const Position& b, const Position& c) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {a, b, c});
  mesh.triangles.push_back({first, first + 1, first + 2});
}

/// Whether every directed edge is matched by exactly one opposite edge: closed and consistently oriented.
inline bool is_closed(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = t[i], b = t[(i + 1) % 3];
      if (++edges[{a, b}] != 1) return false;
    }
  return std::all_of(edges.begin(), edges.end(), [&](const auto& e) {
    return edges.count({e.first.second, e.first.first}) == 1;
  });
}

}  // namespace hiprt::oracle
