#pragma once
/// Scenes of instances as JSON, for people and for programs that write scenes. scene.schema.json is the whole of it.

#include <tools/scene_io/scene/scene_description.h>

#include <hiprt_build/error.h>

#include <filesystem>

namespace hiprt::tools {

/// Reads a description; of meshes and shapes in files the paths only
/// (SceneDescription::files, ShapeSet::path). Paths are relative to the description's
/// folder. Objects and groups are in the order of their names, groups behind those that they have instances of.
/// @return kIo, or kInvalidInput with the place, e.g. "scene.json: groups.forest[17].matrix: 11 numbers, 12 expected"
/// or "scene.json: objects.hair.curves[3][0]: radius -1".
build::Result<SceneDescription> read_scene_json(const std::filesystem::path& path);

}  // namespace hiprt::tools
