#pragma once
/// A scene of instances before anything is built.

#include <tools/scene_io/mesh/mesh_import.h>
#include <tools/scene_io/shapes/shape_import.h>

#include <hiprt_build/merge_levels.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace hiprt::tools {

/// Meshes and shapes in one BVH: geometry i is meshes[i], geometry meshes.size() + i is shapes[i].
struct SceneObject {
  std::string name;                   ///< For messages.
  std::vector<std::size_t> meshes;    ///< Indices of SceneDescription::meshes.
  std::vector<std::size_t> shapes{};  ///< Indices of SceneDescription::shapes.
};

struct SceneGroup {
  std::string location;  ///< Of its list of instances in the file, for messages: "groups.forest".
  std::vector<build::Instance> instances;
};

/// Objects by number, as build::InstancedScene counts them: first the objects, then the groups. Groups have instances
/// of lower numbers; the last group is the scene.
struct SceneDescription {
  std::string path;                ///< Of the description, for messages.
  std::vector<std::string> files;  ///< Mesh i is in files[i]; empty if the description has the meshes itself.
  std::vector<Mesh> meshes;        ///< What files have, read once each.
  std::vector<ShapeSet> shapes;    ///< Those of files: before they are read with their paths only.
  std::vector<SceneObject> objects;
  std::vector<SceneGroup> groups;
  std::vector<std::unique_ptr<build::Motion>> motions;  ///< Those of instances.
  /// Of a scene whose levels are merged: where the groups' instances were, which are in groups and not in it.
  std::optional<build::MergedLevels> merged;
  std::uint64_t shared_objects = 0;  ///< Objects that have the meshes of another one and are that.
};

}  // namespace hiprt::tools
