#pragma once
/// The scene of a command line, with its meshes.

#include <tools/scene_io/scene/scene_description.h>

namespace hiprt::tools {

struct BuildCommand;
class Cli;
class ProgressBar;

/// Reads the scene that the inputs describe or, with --instances, are. Warns as read_meshes() does.
/// @return kInvalidInput if the output is one of the files that were read; errors of the readers.
build::Result<SceneDescription> read_scene(const Cli& cli, const BuildCommand& command, ProgressBar& bar);

}  // namespace hiprt::tools
