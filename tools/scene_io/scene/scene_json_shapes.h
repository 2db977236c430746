#pragma once
/// Spheres and curves that a JSON document has itself.

#include <tools/scene_io/json_location.h>
#include <tools/scene_io/shapes/shape_import.h>

namespace hiprt::tools {

/// {"spheres": [[x, y, z, radius], ...]} or {"curves": [[[x, y, z, radius], ...], ...]}, a list of points per strand.
/// Throws JsonFault.
ShapeSet shapes_of_json(const JsonLocation& location, const nlohmann::json& value);

}  // namespace hiprt::tools
