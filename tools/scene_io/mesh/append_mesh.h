#pragma once
/// Joins meshes.

#include <tools/scene_io/mesh/mesh_import.h>

#include <span>

namespace hiprt::tools {

/// Appends transformed triangles; mirrored ones keep their outside. Does not change the mesh's surface.
/// @param triangles with indices below positions.size().
/// @return the number of the first new vertex; kTooLarge if there would be more than 2^32 - 1.
build::Result<std::uint32_t> append(Mesh& mesh, std::span<const build::Position> positions,
                                    std::span<const build::Triangle> triangles, const Transform& to_world);

}  // namespace hiprt::tools
