#pragma once
/// What bvhrender writes and prints.

#include <tools/cli/cli.h>
#include <tools/cli/render/render_command.h>

#include <cstddef>
#include <string>
#include <vector>

namespace hiprt::tools {

struct WrittenPicture {
  std::string path;
  std::size_t bytes;
};

/// Writes the picture to all outputs of the command line.
/// @param info of the program, for the files' attributes. @param stops whether interrupted() ends it.
build::Result<std::vector<WrittenPicture>> write_pictures(const ToolInfo& info, const RenderCommand& command,
                                                          const Camera& camera, const Image& image, bool stops);

/// What is printed at the end.
struct RenderReport {
  const RenderCommand& command;
  const Camera& camera;
  const Rendering& rendering;
  std::string device, device_name;
  int ranks;
  const std::vector<WrittenPicture>& pictures;
};

void print(const Cli& cli, const RenderReport& report);

}  // namespace hiprt::tools
