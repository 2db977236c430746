#include <tools/build/shape_geometries.h>

#include <tools/base/errors.h>

#include <hiprt_build/format/out_of_memory.h>
#include <hiprt_build/shapes.h>

namespace hiprt::tools {

build::Result<ShapeGeometries> ShapeGeometries::make(std::span<const ShapeSet* const> sets, unsigned threads) {
  return build::or_out_of_memory("for the geometries of shapes", [&]() -> build::Result<ShapeGeometries> {
    ShapeGeometries result;
    for (const ShapeSet* set : sets) {
      auto boxes = build::shape_boxes(set->view(), threads);
      if (!boxes) return fail(boxes.error().code, set->name + ": " + boxes.error().message);
      result.boxes_.push_back(std::move(*boxes));
      const std::uint32_t type = set->kind == ShapeKind::kCurves ? 1 : set->kind == ShapeKind::kMovingTriangles ? 2 : 0;
      result.customs_.push_back(
          {.boxes = result.boxes_.back(), .type = type, .name = set->name, .shapes = set->view()});
    }
    return result;
  });
}

std::vector<const ShapeSet*> pointers(std::span<const ShapeSet> sets) {
  std::vector<const ShapeSet*> result;
  for (const ShapeSet& set : sets) result.push_back(&set);
  return result;
}

}  // namespace hiprt::tools
