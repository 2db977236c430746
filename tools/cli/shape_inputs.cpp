#include <tools/cli/shape_inputs.h>

#include <tools/cli/mesh_inputs.h>

#include <hiprt_build/shapes.h>

namespace hiprt::tools {

build::Result<std::vector<ShapeSet>> read_shapes(const Cli& cli, std::span<const std::string> inputs,
                                                 const std::string& output, ProgressBar& bar) {
  std::vector<ShapeSet> result;
  for (const std::string& input : inputs) {
    bar.update("read", 0);
    auto shapes = load_shapes(input);
    if (interrupted()) return tl::unexpected(cancelled());
    if (!shapes) return tl::unexpected(shapes.error());
    bar.clear();
    if (auto checked = check_output(output, {&input, 1}); !checked) return tl::unexpected(checked.error());
    if (shapes->size() == 0) cli.warn(input + ": no spheres and no segments of curves in it");
    result.push_back(std::move(*shapes));
  }
  return result;
}

build::Result<ShapeGeometries> ShapeGeometries::make(std::span<const ShapeSet* const> sets, unsigned threads) {
  ShapeGeometries result;
  for (const ShapeSet* set : sets) {
    auto boxes = build::shape_boxes(set->view(), threads);
    if (!boxes) return tl::unexpected(build::Error{boxes.error().code, set->name + ": " + boxes.error().message});
    result.boxes_.push_back(std::move(*boxes));
    const std::uint8_t type = set->kind == ShapeKind::kCurves ? 1 : 0;
    result.customs_.push_back({.boxes = result.boxes_.back(), .type = type, .name = set->name, .shapes = set->view()});
  }
  return result;
}

std::vector<const ShapeSet*> pointers(std::span<const ShapeSet> sets) {
  std::vector<const ShapeSet*> result;
  for (const ShapeSet& set : sets) result.push_back(&set);
  return result;
}

}  // namespace hiprt::tools
