#pragma once
/// What a builder takes.

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

}  // namespace hiprt::build
