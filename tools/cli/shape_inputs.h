#pragma once
/// The shapes of a command line, as the library takes them.

#include <tools/cli/cli.h>
#include <tools/cli/progress.h>
#include <tools/scene_io/shapes/shape_import.h>

#include <hiprt_build/build.h>

#include <span>
#include <string>
#include <vector>

namespace hiprt::tools {

/// Reads all files; warns of files without spheres or segments.
/// @return kInvalidInput if @p output is one of the files; load_shapes()'s errors.
build::Result<std::vector<ShapeSet>> read_shapes(const Cli& cli, std::span<const std::string> inputs,
                                                 const std::string& output, ProgressBar& bar);

/// Custom geometries and the boxes that they look at: of custom type 0 for spheres, 1 for curves.
class ShapeGeometries {
 public:
  /// @param sets that have to live as long as this. @param threads see shape_boxes(). @return its errors, with the
  /// set's name.
  static build::Result<ShapeGeometries> make(std::span<const ShapeSet* const> sets, unsigned threads);

  std::span<const build::CustomGeometry> customs() const { return customs_; }

 private:
  std::vector<std::vector<Box>> boxes_;
  std::vector<build::CustomGeometry> customs_;
};

/// Pointers to all of them.
std::vector<const ShapeSet*> pointers(std::span<const ShapeSet> sets);

}  // namespace hiprt::tools
