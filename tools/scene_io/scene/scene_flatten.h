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
  const std::string* name;  ///< Name of the mesh in the description.
  std::size_t mesh;         ///< Its number there.
  Transform to_scene;       ///< The transform of the vertices.
};

/// Makes a geometry for every path from the scene to a mesh, depth first in the order of the instances. Vertices are
/// transformed by the product of the instances' matrices, in double, and rounded once. Mirrored meshes keep their
/// outside: the second and third corners of their triangles are swapped.
/// @return kTooLarge with the number of triangles or geometries, kOutOfMemory, kCancelled, or kInvalidInput.
/// kInvalidInput means that no single mask can replace the masks of a path, or that an object has shapes.
build::Result<std::vector<FlatGeometry>> flatten_scene(const SceneDescription& scene);
/// The same for one object or group. @param to_scene, mask of an instance of it.
build::Result<std::vector<FlatGeometry>> flatten_object(const SceneDescription& scene, std::size_t object,
                                                        const Transform& to_scene, std::uint32_t mask);

/// @return the geometry with the surface of its mesh; normals are in the space of the vertices.
Mesh to_mesh(const SceneDescription& scene, FlatGeometry&& geometry);

/// Views for the builder. @p geometries must outlive them.
std::vector<build::TriangleMesh> views(std::span<const FlatGeometry> geometries);

}  // namespace hiprt::tools
