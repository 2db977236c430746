#pragma once
/// The scene of a command line, with its meshes.

#include <tools/cli/build_command.h>
#include <tools/cli/cli.h>
#include <tools/cli/progress.h>
#include <tools/scene_io/scene/scene_description.h>

namespace hiprt::tools {

/// Reads the scene that the inputs describe or, with --instances, are. Warns as read_meshes() does.
/// @return kInvalidInput if the output is one of the files that were read; errors of the readers.
build::Result<SceneDescription> read_scene(const Cli& cli, const BuildCommand& command, ProgressBar& bar);

}  // namespace hiprt::tools
