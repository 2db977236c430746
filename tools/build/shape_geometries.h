#pragma once
/// Sets of spheres and curves as custom geometries of the builder.

#include <tools/scene_io/shapes/shape_import.h>

#include <span>
#include <vector>

namespace hiprt::tools {

/// Owns the boxes that the geometries refer to. Spheres have custom type 0, curves have custom type 1.
class ShapeGeometries {
 public:
  /// @param sets must outlive the result. @param threads see build::shape_boxes().
  /// @return the errors of build::shape_boxes(), with the set's name; kOutOfMemory.
  static build::Result<ShapeGeometries> make(std::span<const ShapeSet* const> sets, unsigned threads);

  std::span<const build::CustomGeometry> customs() const { return customs_; }

 private:
  std::vector<std::vector<Box>> boxes_;
  std::vector<build::CustomGeometry> customs_;
};

/// @return a pointer to each set.
std::vector<const ShapeSet*> pointers(std::span<const ShapeSet> sets);

}  // namespace hiprt::tools
