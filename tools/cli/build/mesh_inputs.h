#pragma once
/// Reads the mesh files that a command line names.

#include <tools/scene_io/mesh/mesh_import.h>

#include <span>
#include <string>
#include <vector>

namespace hiprt::tools {

class Cli;
class ProgressBar;

/// Warns of what was ignored, of skipped faces, and of a mesh without triangles.
void warn_of(const Cli& cli, const std::string& input, const Mesh& mesh);

/// Reads all files and warns as warn_of() does.
/// @return the errors of load_mesh(); kInvalidInput if @p output is one of the files that were read.
build::Result<std::vector<Mesh>> read_meshes(const Cli& cli, std::span<const std::string> inputs,
                                             const std::string& output, ProgressBar& bar);

}  // namespace hiprt::tools
