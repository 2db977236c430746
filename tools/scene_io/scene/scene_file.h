#pragma once
/// Files that describe a scene of instances, in either format: JSON (.json) or binary (.scene).

#include <hiprt_build/error.h>

#include <filesystem>
#include <string>

namespace hiprt::tools {

struct SceneDescription;

/// Whether the name ends in .json or .scene, in any case.
bool is_scene_file(const std::string& path);

/// @pre is_scene_file(path). @return as read_scene_json() or read_scene_binary().
build::Result<SceneDescription> read_scene_file(const std::string& path);

}  // namespace hiprt::tools
