#pragma once
/// Scenes that need no file: the same on every run.

#include <hiprt_build/error.h>
#include <tools/render/scene/camera.h>
#include <tools/scene_io/mesh/mesh_import.h>

#include <cstdint>

namespace hiprt::bench {

/// Half the side of the ground, which lies around the origin; y is up.
inline constexpr double kGroundHalf = 50.0;

/// Hills of about @p triangles triangles over a square grid. @pre triangles >= 2.
tools::Mesh height_field(std::uint32_t triangles);

/// Hills of about triangles / 2 with stretched and turned spheres of the other half on and above them: long and short
/// triangles, open and cluttered places. @pre triangles >= 2.
tools::Mesh procedural_mesh(std::uint32_t triangles);

/// The same triangles in random order, each with vertices of its own: what an STL file holds.
tools::Mesh scattered(const tools::Mesh& mesh);

/// A view across the hills.
tools::Camera procedural_camera();

}  // namespace hiprt::bench
