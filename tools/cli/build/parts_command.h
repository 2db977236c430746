#pragma once
/// bvhbuild --parts: a scene of instances in several files.

#include <tools/build/build_request.h>
#include <tools/scene_io/scene/scene_description.h>

namespace hiprt::tools {

struct BuildCommand;
class Cli;
class ProgressBar;

/// Builds the parts of a scene and writes them with their manifest. Materials are read from the inputs again. Prints a
/// report if the command line asks for one.
/// @param scene prepared for the builder. Its meshes are freed. @param read_seconds for the report.
/// @return the errors of build_objects(), load_surfaces() and build_parts().
build::Result<void> run_parts(const Cli& cli, const BuildCommand& command, SceneDescription& scene,
                              const BuildRequest& request, double read_seconds, ProgressBar& bar);

}  // namespace hiprt::tools
