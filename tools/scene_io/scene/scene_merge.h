#pragma once
/// A scene of instances with fewer levels.

#include <tools/scene_io/scene/scene_description.h>

#include <hiprt_build/error.h>

namespace hiprt::tools {

/// Merges the scene's groups until no more than @p levels are left, 1 or more (hiprt_build/merge_levels.h); the scene
/// says then where instances were (SceneDescription::merged).
/// @return errors of build::merge_levels().
build::Result<void> merge_scene(SceneDescription& scene, unsigned levels);

}  // namespace hiprt::tools
