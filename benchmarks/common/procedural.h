#pragma once
/// Generated scenes. They are the same on every run.

#include <hiprt_build/error.h>
#include <tools/render/scene/camera.h>
#include <tools/scene_io/mesh/mesh_import.h>

#include <cstdint>

namespace hiprt::bench {

/// Half the side of the ground, which lies around the origin; y is up.
inline constexpr double kGroundHalf = 50.0;

/// Hills of about @p triangles triangles over a square grid. @pre triangles >= 2.
tools::Mesh height_field(std::uint32_t triangles);

/// Hills of about triangles / 2 triangles, and stretched, rotated spheres of the other half on and above them. The
/// scene has long and short triangles, and sparse and dense regions. @pre triangles >= 2.
tools::Mesh procedural_mesh(std::uint32_t triangles);

/// The same triangles in random order with unshared vertices, as in an STL file.
tools::Mesh scattered(const tools::Mesh& mesh);

/// A view across the hills.
tools::Camera procedural_camera();

}  // namespace hiprt::bench
