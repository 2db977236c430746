#pragma once
/// What a builder takes.

#include <hiprt_device/format/node.h>

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

namespace hiprt::build {

using Position = std::array<float, 3>;
using Triangle = std::array<std::uint32_t, 3>;

/// An indexed triangle mesh; becomes one geometry. The spans are read during build() only.
/// Triangles with a NaN or infinite corner, or with two corners at the same position, are dropped: they keep their
/// number but no ray hits them, and they are counted (BuildStatistics). Zero-area triangles with three distinct corners
/// stay, because they can close a gap between neighbours.
struct TriangleMesh {
  std::span<const Position> positions;  ///< Fewer than 2^31.
  std::span<const Triangle> triangles;  ///< Indices below positions.size(). Fewer than 2^30; of all meshes, than 2^31.
  std::uint32_t mask = 0xffffffffu;     ///< A ray sees the mesh iff (ray.mask & mask) != 0.
  std::string_view name{};              ///< For the provenance block.
};

/// Custom primitives: what they are only the program knows (its intersection functions, found by type); becomes one
/// geometry. The spans are read during build() only.
/// Boxes with NaN or infinite coordinates, or with min > max, are dropped as degenerate triangles are. A box must hold
/// all points at which the program's function may report a hit.
struct CustomGeometry {
  std::span<const Box> boxes;        ///< Primitive i is in boxes[i]. With all primitives of the scene fewer than 2^31.
  std::uint8_t type = 0;             ///< The program's own number for what the primitives are.
  std::uint32_t mask = 0xffffffffu;  ///< A ray sees the geometry iff (ray.mask & mask) != 0.
  std::string_view name{};           ///< For the provenance block.
};

/// Everything in one BVH: meshes[i] becomes geometry i, customs[i] geometry meshes.size() + i.
struct SceneInput {
  std::span<const TriangleMesh> meshes{};
  std::span<const CustomGeometry> customs{};
};

}  // namespace hiprt::build
