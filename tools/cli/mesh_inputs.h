#pragma once
/// The meshes of a command line.

#include <tools/cli/cli.h>
#include <tools/cli/progress.h>
#include <tools/scene_io/mesh/mesh_import.h>

#include <hiprt_build/build.h>

#include <span>
#include <string>
#include <vector>

namespace hiprt::tools {

/// What an interrupted tool says.
inline build::Error cancelled() { return {build::ErrorCode::kCancelled, "cancelled"}; }

/// Warns of skipped faces, and of a mesh without triangles.
void warn_of(const Cli& cli, const std::string& input, const Mesh& mesh);

/// Reads all files; warns of what is skipped, and of files without triangles.
/// @return kInvalidInput if @p output is one of the files that were read; load_mesh()'s errors.
build::Result<std::vector<Mesh>> read_meshes(const Cli& cli, std::span<const std::string> inputs,
                                             const std::string& output, ProgressBar& bar);

/// As the library takes them; they stay in @p meshes.
std::vector<build::TriangleMesh> views(std::span<const Mesh> meshes);

/// Draws the bar; false when the program was interrupted.
inline build::ProgressCallback shown_by(ProgressBar& bar) {
  return [&bar](const build::Progress& progress) {
    bar.update(progress.step, progress.fraction);
    return !interrupted();
  };
}

}  // namespace hiprt::tools
