#pragma once
/// Converts a scene of instances to meshes.

#include <tools/scene_io/scene/scene_description.h>
#include <tools/scene_io/transform.h>

#include <hiprt_build/error.h>

#include <cstdint>
#include <vector>

namespace hiprt::tools {

/// A mesh of an instance in the scene's space.
struct FlatGeometry {
  std::vector<build::Position> positions;
  std::vector<build::Triangle> triangles;
  std::uint32_t mask;       ///< A ray sees it if and only if it sees every instance of the path.
  const std::string* name;  ///< Of the mesh in the description.
  std::size_t mesh;         ///< Its number there.
  Transform to_scene;       ///< The transform of the vertices.
};

/// Every path from the scene to a mesh, depth first in the order of the instances. Vertices are transformed by the
/// product of the instances' matrices, in double, and rounded once; mirrored meshes keep their outside (their
/// triangles' second and third corners swap).
/// @return kTooLarge with the number of triangles or geometries; kInvalidInput if the masks of a path cannot be one
/// mask, or an object has shapes; kOutOfMemory; kCancelled.
build::Result<std::vector<FlatGeometry>> flatten_scene(const SceneDescription& scene);
/// The same for one object or group. @param to_scene, mask of an instance of it.
build::Result<std::vector<FlatGeometry>> flatten_object(const SceneDescription& scene, std::size_t object,
                                                        const Transform& to_scene, std::uint32_t mask);

/// With the surface of the mesh that it is of, its normals where the vertices are.
Mesh to_mesh(const SceneDescription& scene, FlatGeometry&& geometry);

/// Views for the builder. @p geometries must outlive them.
std::vector<build::TriangleMesh> views(std::span<const FlatGeometry> geometries);

}  // namespace hiprt::tools
