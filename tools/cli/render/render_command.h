#pragma once
/// The command line of bvhrender.

#include <tools/cli/ranks/run_options.h>
#include <tools/cli/render/compare_command.h>
#include <tools/cli/render/path_command.h>
#include <tools/render/scene/camera.h>
#include <tools/render/studio/render.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace hiprt::tools {

struct RenderCommand {
  std::string path;
  std::vector<std::string> outputs;
  std::string size = "1024x768", camera, mode = "ao", device = "auto", shutter = "0,0";
  std::uint64_t max_memory = 0;   ///< Bytes that readers may take; 0: half of the machine's.
  std::optional<unsigned> level;  ///< Of --mode bvh; see tree_level().
  RenderOptions render;           ///< Complete after finish().
  CompareCommand compare;
  PathCommand paths;
  ResumeOptions resume;
  RankFlags ranks;

  /// Fills `render` from the words of the command line. @pre they were checked.
  void finish();

  /// Level of the tree whose boxes --mode bvh draws.
  unsigned tree_level() const;
  /// Name of the mode or integrator, e.g. "ao" or "path".
  std::string mode_name() const;
  /// The same with the level, e.g. "bvh, level 3".
  std::string mode_text() const;
};

/// Adds every option of bvhrender, and the checks of options that exclude or need each other.
void add_render_options(CLI::App& app, RenderCommand& command);

/// @return the camera of the command line, or one that sees all of @p bounds.
build::Result<Camera> choose_camera(const RenderCommand& command, const Box& bounds);

}  // namespace hiprt::tools
