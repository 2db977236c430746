#pragma once
/// Reads the files of shapes that a command line names.

#include <tools/scene_io/shapes/shape_import.h>

#include <span>
#include <string>
#include <vector>

namespace hiprt::tools {

class Cli;
class ProgressBar;

/// Reads all files. Warns if a file has neither spheres nor segments of curves.
/// @return kInvalidInput if @p output is one of the files; load_shapes()'s errors.
build::Result<std::vector<ShapeSet>> read_shapes(const Cli& cli, std::span<const std::string> inputs,
                                                 const std::string& output, ProgressBar& bar);

}  // namespace hiprt::tools
