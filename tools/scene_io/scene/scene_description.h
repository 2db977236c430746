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
  std::vector<Mesh> meshes;        ///< Meshes of the files, read once each.
  std::vector<ShapeSet> shapes;    ///< A file that is not read yet has its path only.
  std::vector<SceneObject> objects;
  std::vector<SceneGroup> groups;
  std::vector<std::unique_ptr<build::Motion>> motions;  ///< Motions that instances refer to.
  /// For a scene with merged levels: where the instances of its groups came from.
  std::optional<build::MergedLevels> merged;
  std::vector<std::string> warnings{};  ///< With locations in the description.
  std::uint64_t shared_objects = 0;     ///< Objects that are shared because they have the same meshes.
};

}  // namespace hiprt::tools
