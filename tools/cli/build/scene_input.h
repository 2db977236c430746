#pragma once
/// Reads the scene that a command line names, with its meshes.

#include <tools/scene_io/scene/scene_description.h>

namespace hiprt::tools {

struct BuildCommand;
class Cli;
class ProgressBar;

/// Reads a scene file, or with --instances makes a scene of mesh files. Warns as read_meshes() does.
/// @return kInvalidInput if the output is one of the files that were read; errors of the readers.
build::Result<SceneDescription> read_scene(const Cli& cli, const BuildCommand& command, ProgressBar& bar);

}  // namespace hiprt::tools
