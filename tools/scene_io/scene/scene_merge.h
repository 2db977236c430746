#pragma once
/// Reduces the levels of a scene of instances.

#include <tools/scene_io/scene/scene_description.h>

#include <hiprt_build/error.h>

namespace hiprt::tools {

/// Merges the scene's groups until at most @p levels levels (1 or more) are left; see hiprt_build/merge_levels.h.
/// SceneDescription::merged then holds the original paths of instances.
/// @return errors of build::merge_levels().
build::Result<void> merge_scene(SceneDescription& scene, unsigned levels);

}  // namespace hiprt::tools
