#pragma once
/// The geometries of a build as one numbering of primitives, and the groups of one or two that become leaves. Internal.

#include <hiprt_build/input.h>
#include <hiprt_build/input/dropped_primitives.h>
#include <hiprt_build/presplit/clip.h>
#include <hiprt_build/tree/aabb.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hiprt::build {

/// A primitive by its geometry and its number there.
struct PrimitivePlace {
  std::uint32_t geometry, primitive;
};

/// Primitives of all geometries, numbered geometry by geometry: first the meshes, then the custom geometries.
struct PrimitiveSoup {
  std::span<const TriangleMesh> meshes;
  std::span<const CustomGeometry> customs;
  std::vector<std::uint64_t> first{0};  ///< Of geometry i; one more at the end: the number of all.

  explicit PrimitiveSoup(const SceneInput& scene) : meshes(scene.meshes), customs(scene.customs) {
    for (const TriangleMesh& mesh : meshes) first.push_back(first.back() + mesh.triangles.size());
    for (const CustomGeometry& custom : customs) first.push_back(first.back() + custom.boxes.size());
  }

  std::size_t geometries() const { return meshes.size() + customs.size(); }
  std::uint64_t size() const { return first.back(); }
  std::uint64_t size(std::size_t geometry) const { return first[geometry + 1] - first[geometry]; }
  bool is_custom(std::size_t geometry) const { return geometry >= meshes.size(); }
  /// @param number below size().
  PrimitivePlace locate(std::uint64_t number) const {
    const auto next = std::upper_bound(first.begin(), first.end(), number);
    return PrimitivePlace{static_cast<std::uint32_t>(next - first.begin() - 1),
                          static_cast<std::uint32_t>(number - *(next - 1))};
  }
  const Box& box(std::uint32_t geometry, std::uint32_t primitive) const {
    return customs[geometry - meshes.size()].boxes[primitive];
  }
  const Position& corner(std::uint32_t mesh, std::uint32_t triangle, unsigned k) const {
    return meshes[mesh].positions[meshes[mesh].triangles[triangle][k]];
  }
};

/// @pre the triangle's indices are below positions.size().
inline Fate triangle_fate(const TriangleMesh& mesh, std::size_t triangle) {
  const auto corner = [&](unsigned k) { return mesh.positions[mesh.triangles[triangle][k]].data(); };
  return triangle_fate(corner(0), corner(1), corner(2));
}

inline Float4 to_float4(const Position& p) { return Float4{p[0], p[1], p[2], 0.0f}; }

/// One leaf: a triangle, or two that share an edge, or one or two custom primitives. Numbers are within the geometry.
/// Stored corner k of a triangle is the mesh's corner (k + rotation) % 3; the shared edge is v1 v2 (see LeafInfo).
struct PrimitiveGroup {
  /// rotation0 of custom primitives.
  static constexpr std::uint32_t kCustom = 3;

  std::uint32_t primitive[2];  ///< The second is kInvalidId where there is but one.
  std::uint32_t geometry : 28;
  std::uint32_t rotation0 : 2;
  std::uint32_t rotation1 : 2;

  bool is_pair() const { return primitive[1] != kInvalidId; }
  bool is_custom() const { return rotation0 == kCustom; }
  /// Corners v0, v1, v2, v3; v3 = v2 for a single triangle. @pre triangles.
  std::array<Position, 4> vertices(const PrimitiveSoup& soup) const {
    std::array<Position, 4> v;
    for (unsigned k = 0; k < 3; ++k) v[k] = soup.corner(geometry, primitive[0], (k + rotation0) % 3);
    v[3] = is_pair() ? soup.corner(geometry, primitive[1], (1 + rotation1) % 3) : v[2];
    return v;
  }
  Aabb bounds(const PrimitiveSoup& soup) const {
    Aabb box;
    if (is_custom()) {
      for (unsigned i = 0; i < (is_pair() ? 2u : 1u); ++i) box.add(to_aabb(soup.box(geometry, primitive[i])));
    } else {
      for (const Position& v : vertices(soup)) box.add(to_float4(v));
    }
    return box;
  }
};
static_assert(sizeof(PrimitiveGroup) == 12);

/// @pre triangles.
inline LeafCorners leaf_corners(const PrimitiveSoup& soup, const PrimitiveGroup& group) {
  const std::array<Position, 4> v = group.vertices(soup);
  LeafCorners corners;
  for (unsigned k = 0; k < 4; ++k) corners.v[k] = Point{{v[k][0], v[k][1], v[k][2]}};
  return corners;
}

/// @pre triangles.
inline SplitBounds split_bounds(const PrimitiveSoup& soup, const PrimitiveGroup& group, const Aabb& box, unsigned axis,
                                float plane) {
  return split_bounds(leaf_corners(soup, group), group.is_pair(), box, axis, plane);
}

}  // namespace hiprt::build
