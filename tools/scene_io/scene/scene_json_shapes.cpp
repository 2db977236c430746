#include <tools/scene_io/scene/scene_json_shapes.h>

#include <tools/base/text.h>

#include <hiprt_build/shapes.h>

#include <nlohmann/json.hpp>

namespace hiprt::tools {
namespace {

using Json = nlohmann::json;

ShapePoint point_of(const JsonLocation& location, const Json& value) {
  const auto numbers = json_numbers<4>(location, value);
  ShapePoint point{};
  for (std::size_t i = 0; i < 3; ++i) point.position[i] = static_cast<float>(numbers[i]);
  point.radius = static_cast<float>(numbers[3]);
  if (const std::string fault = shape_point_fault(point); !fault.empty()) json_fault(location, fault);
  return point;
}

/// @return how many.
std::uint32_t add_points(const JsonLocation& location, const Json& value, ShapeSet& shapes) {
  json_array(location, value);
  for (std::size_t i = 0; i < value.size(); ++i) shapes.points.push_back(point_of(JsonLocation(location, i), value[i]));
  return static_cast<std::uint32_t>(value.size());
}

void add_strands(const JsonLocation& location, const Json& value, ShapeSet& shapes) {
  json_array(location, value);
  std::vector<std::uint32_t> points;
  for (std::size_t i = 0; i < value.size(); ++i) {
    const JsonLocation at(location, i);
    points.push_back(add_points(at, value[i], shapes));
    if (points.back() < 2) json_fault(at, std::to_string(points.back()) + " points, 2 or more expected");
  }
  shapes.strands = points.size();
  shapes.segments = build::strand_segments(points);
}

}  // namespace

ShapeSet shapes_of_json(const JsonLocation& location, const Json& value) {
  ShapeSet shapes;
  shapes.name = location.text();
  const bool curves = value.contains("curves");
  for (const auto& [key, content] : value.items())
    if (key != "spheres" && key != "curves") json_fault(location, "unknown key " + in_quotes(key));
  if (value.size() != 1) json_fault(location, "either 'spheres' or 'curves' expected");
  shapes.kind = curves ? ShapeKind::kCurves : ShapeKind::kSpheres;
  const JsonLocation list(location, curves ? "curves" : "spheres");
  curves ? add_strands(list, value["curves"], shapes) : static_cast<void>(add_points(list, value["spheres"], shapes));
  if (shapes.points.empty())
    json_fault(list, curves ? "0 strands, 1 or more expected" : "0 spheres, 1 or more expected");
  return shapes;
}

}  // namespace hiprt::tools
