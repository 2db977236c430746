#include <hiprt_build/exec/run_cpu.h>
#include <hiprt_build/input/check_input.h>
#include <hiprt_build/shapes.h>

namespace hiprt::build {
namespace {

/// "point 17: radius -1"
std::string point_fault(const Shapes& shapes, std::size_t i) {
  const ShapePoint& point = shapes.points[i];
  std::string message = "point " + std::to_string(i) + ": ";
  for (unsigned axis = 0; axis < 3; ++axis)
    if (!shape_detail::is_finite(point.position[axis]))
      return message + "xyz"[axis] + " is " + text(static_cast<double>(point.position[axis]));
  const bool moves = shapes.kind == ShapeKind::kMovingTriangles;
  return message + (moves ? "time " : "radius ") + text(static_cast<double>(point.radius)) +
         (point.radius < 0.0f && !moves ? ", at least 0 expected" : ", a finite number expected");
}

/// The keys of moving triangles, and that other shapes have none.
Result<void> check_keys(const Shapes& shapes, const std::string& prefix) {
  const std::string keys = prefix + std::to_string(shapes.keys) + " keys";
  if (shapes.kind != ShapeKind::kMovingTriangles) {
    if (shapes.keys == 0) return {};
    return tl::unexpected(invalid(keys + " of shapes that do not move"));
  }
  if (shapes.keys < 2) return tl::unexpected(invalid(keys + " of moving triangles, 2 or more expected"));
  if (shapes.points.size() % shapes.keys != 0)
    return tl::unexpected(
        invalid(keys + ", but " + std::to_string(shapes.points.size()) + " points: each key needs all vertices"));
  if (shapes.segments.size() % 3 != 0)
    return tl::unexpected(
        invalid(prefix + std::to_string(shapes.segments.size()) + " vertex numbers, a multiple of 3 expected"));
  return {};
}

/// "point 7: time 0.5, ...": the first vertex whose time is not its key's, or does not grow.
Result<void> check_times(CpuEngine& engine, const Shapes& shapes, const std::string& prefix) {
  if (shapes.kind != ShapeKind::kMovingTriangles) return {};
  const std::span<const ShapePoint> points = shapes.points;
  const std::size_t vertices = points.size() / shapes.keys;
  const std::size_t i =
      engine.find_first(points.size(), [&](std::size_t k) { return !has_good_time(points, vertices, k); });
  if (i == points.size()) return {};
  const std::size_t other = i % vertices == 0 ? i - vertices : i - i % vertices;
  return tl::unexpected(
      invalid(prefix + "point " + std::to_string(i) + ": time " + text(static_cast<double>(points[i].radius)) + ", " +
              (i % vertices == 0 ? "later than " : "that of its key is ") +
              text(static_cast<double>(points[other].radius)) + (i % vertices == 0 ? " expected" : "")));
}

/// Segments or vertex numbers beyond the points.
Result<void> check_segments(CpuEngine& engine, const Shapes& shapes, const std::string& prefix) {
  const bool moves = shapes.kind == ShapeKind::kMovingTriangles;
  const std::size_t points = shapes.points.size(), limit = moves ? points / shapes.keys : points, more = moves ? 0 : 1;
  const std::size_t i =
      engine.find_first(shapes.segments.size(), [&](std::size_t k) { return shapes.segments[k] + more >= limit; });
  if (i == shapes.segments.size()) return {};
  if (moves)
    return tl::unexpected(invalid(prefix + "triangle " + std::to_string(i / 3) + ": vertex " +
                                  std::to_string(shapes.segments[i]) + ", but there are " + std::to_string(limit)));
  return tl::unexpected(
      invalid(prefix + "segment " + std::to_string(i) + ": points " + std::to_string(shapes.segments[i]) + " and " +
              std::to_string(std::uint64_t{shapes.segments[i]} + 1) + ", but there are " + std::to_string(points)));
}

/// @param prefix of messages.
Result<void> check_shapes(CpuEngine& engine, const Shapes& shapes, const std::string& prefix) {
  constexpr std::uint64_t kMostPoints = kInvalidId;
  if (shapes.kind > ShapeKind::kMovingTriangles)
    return tl::unexpected(
        invalid(prefix + "shapes of kind " + std::to_string(static_cast<std::uint32_t>(shapes.kind))));
  const std::size_t points = shapes.points.size();
  if (points > kMostPoints)
    return tl::unexpected(
        Error{ErrorCode::kTooLarge,
              prefix + std::to_string(points) + " points of shapes, the limit is " + std::to_string(kMostPoints)});
  if (segment_numbers(shapes.kind) == 0 && !shapes.segments.empty())
    return tl::unexpected(
        invalid(prefix + std::to_string(shapes.segments.size()) + " segments of shapes that are no curves"));
  if (auto keys = check_keys(shapes, prefix); !keys) return keys;
  const std::size_t bad =
      engine.find_first(points, [&](std::size_t i) { return !shape_detail::is_valid(shapes.points[i], shapes.kind); });
  if (bad != points) return tl::unexpected(invalid(prefix + point_fault(shapes, bad)));
  if (auto times = check_times(engine, shapes, prefix); !times) return times;
  return check_segments(engine, shapes, prefix);
}

/// Boxes that build() drops need not hold anything.
bool holds(const Box& box, const Box& shape) {
  for (unsigned axis = 0; axis < 3; ++axis)
    if (!(shape_detail::is_finite(box.min[axis]) && shape_detail::is_finite(box.max[axis]) &&
          box.min[axis] <= box.max[axis]))
      return true;
  for (unsigned axis = 0; axis < 3; ++axis)
    if (box.min[axis] > shape.min[axis] || box.max[axis] < shape.max[axis]) return false;
  return true;
}

}  // namespace

Result<void> check_shapes(CpuEngine& engine, const BuildInput& input) {
  for (std::size_t c = 0; c < input.customs.size(); ++c) {
    const CustomGeometry& custom = input.customs[c];
    const Shapes& shapes = custom.shapes;
    if (shapes.kind == ShapeKind::kNone && shapes.points.empty() && shapes.segments.empty()) continue;
    const std::size_t geometry = input.meshes.size() + c;
    const std::string here = describe(input, geometry) + ": ";
    if (shapes.kind == ShapeKind::kNone || shapes.kind > ShapeKind::kMovingTriangles)
      return tl::unexpected(
          invalid(here + "shapes of kind " + std::to_string(static_cast<std::uint32_t>(shapes.kind))));
    if (auto checked = check_shapes(engine, shapes, here); !checked) return checked;
    if (shapes.size() != custom.boxes.size())
      return tl::unexpected(invalid(here + std::to_string(shapes.size()) + " shapes, but " +
                                    std::to_string(custom.boxes.size()) + " boxes"));
    const std::size_t outside =
        engine.find_first(shapes.size(), [&](std::size_t i) { return !holds(custom.boxes[i], shapes.bounds(i)); });
    if (outside != shapes.size())
      return tl::unexpected(invalid(describe(input, geometry, outside) + "its shape is not inside its box"));
  }
  return {};
}

Result<std::vector<Box>> shape_boxes(const Shapes& shapes, unsigned threads) {
  return run_cpu("boxes of shapes", threads, {}, [&](CpuEngine& engine) -> Result<std::vector<Box>> {
    if (auto checked = check_shapes(engine, shapes, ""); !checked) return tl::unexpected(checked.error());
    std::vector<Box> boxes(shapes.size());
    engine.for_each(boxes.size(), [&](std::size_t i) {
      const Box box = shapes.bounds(i);
      // Finite, so that build() counts it as degenerate and not as infinite.
      boxes[i] = box.min[0] <= box.max[0] ? box : Box{{1, 1, 1}, {-1, -1, -1}};
    });
    return boxes;
  });
}

std::vector<std::uint32_t> strand_segments(std::span<const std::uint32_t> points) {
  std::vector<std::uint32_t> segments;
  std::size_t count = 0;
  for (const std::uint32_t n : points) count += n > 1 ? n - 1 : 0;
  segments.reserve(count);
  std::uint32_t first = 0;
  for (const std::uint32_t n : points) {
    for (std::uint32_t i = 0; i + 1 < n; ++i) segments.push_back(first + i);
    first += n;
  }
  return segments;
}

}  // namespace hiprt::build
