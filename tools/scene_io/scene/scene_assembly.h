#pragma once
/// Makes a scene of instances from files of meshes and shapes.

#include <tools/scene_io/mesh/mesh_import.h>
#include <tools/scene_io/scene/scene_description.h>

#include <vector>

namespace hiprt::tools {

/// Appends each mesh of a file as a separate object; one that deforms as triangles that move. Appends the instances of
/// these objects to the scene's first group. The id of an instance is its number in that group.
/// @param times that the file was loaded with.
/// @pre the scene has the group.
void add_assembly(SceneDescription& scene, MeshAssembly assembly, const std::vector<float>& times);

/// Appends an object of the shapes, and an instance of it. @pre the scene has a group.
void add_shape_object(SceneDescription& scene, ShapeSet shapes);

}  // namespace hiprt::tools
