#pragma once
/// Scenes of instances as JSON, for people and for programs that write scenes. scene.schema.json describes the format.

#include <tools/scene_io/scene/scene_description.h>

#include <hiprt_build/error.h>

#include <filesystem>

namespace hiprt::tools {

/// Reads a description, but not the files of meshes and shapes: SceneDescription::files and ShapeSet::path are their
/// paths, relative to the description's folder. Objects and groups are in the order of their names. Groups come after
/// the groups that they have instances of.
/// @return kIo, or kInvalidInput with the location: "scene.json: groups.forest[17].matrix: 11 numbers, 12 expected" or
/// "scene.json: objects.hair.curves[3][0]: radius -1".
build::Result<SceneDescription> read_scene_json(const std::filesystem::path& path);

}  // namespace hiprt::tools
