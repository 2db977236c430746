#pragma once
/// A scene of instances as plain meshes.

#include <tools/scene_io/scene/scene_description.h>
#include <tools/scene_io/transform.h>

#include <hiprt_build/error.h>

#include <cstdint>
#include <vector>

namespace hiprt::tools {

/// A mesh of an instance where the scene has it.
struct FlatGeometry {
  std::vector<build::Position> positions;
  std::vector<build::Triangle> triangles;
  std::uint32_t mask;       ///< A ray sees it iff it sees every instance on the way.
  const std::string* name;  ///< Of the mesh in the description.
  std::size_t mesh;         ///< Its number there.
  Transform to_scene;       ///< What the vertices were transformed by.
};

/// Every way from the scene to a mesh, depth first in the order of the instances. Vertices are transformed by the
/// product of the instances' matrices, in double, and rounded once; mirrored meshes keep their outside (their
/// triangles' second and third corners change places).
/// @return kTooLarge with the number of triangles or geometries; kInvalidInput if no one mask stands for those on a
/// way, or an object has shapes; kOutOfMemory; kCancelled.
build::Result<std::vector<FlatGeometry>> flatten_scene(const SceneDescription& scene);
/// The same of one object or group. @param to_scene, mask of an instance of it.
build::Result<std::vector<FlatGeometry>> flatten_object(const SceneDescription& scene, std::size_t object,
                                                        const Transform& to_scene, std::uint32_t mask);

/// With the surface of the mesh that it is of, its normals where the vertices are.
Mesh to_mesh(const SceneDescription& scene, FlatGeometry&& geometry);

/// As the library takes them; they stay in @p geometries.
std::vector<build::TriangleMesh> views(std::span<const FlatGeometry> geometries);

}  // namespace hiprt::tools
