#include <hiprt_build/format/record_checks.h>
#include <hiprt_build/format/validate_shapes.h>

#include <cstdint>
#include <limits>
#include <span>

namespace hiprt::format_detail {

namespace {

/// Checks the shapes of a file whose tree, leaves and primitive map have been checked.
template <class Layout> class ShapeCheck {
 public:
  explicit ShapeCheck(const BufferView& view)
      : view_(view), leaves_(view.records<typename Layout::Leaf>(view.leaves)) {}

  Check run() const {
    for (std::size_t g = 0; g < view_.shapes.size(); ++g) {
      if (auto points = check_points(g); !points) return points;
      if (auto times = check_times(g); !times) return times;
      if (auto segments = check_segments(g); !segments) return segments;
      if (auto boxes = check_boxes(g); !boxes) return boxes;
    }
    return {};
  }

 private:
  Check check_points(std::size_t geometry) const {
    const auto points = view_.points_of(geometry);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ShapePoint& point = points[i];
      if (shape_detail::is_valid(point, view_.shapes[geometry].kind)) continue;
      unsigned bad = 0;
      while (bad < 3 && shape_detail::is_finite(point.position[bad])) ++bad;
      return fail_float(FormatError::kBadShape, view_.shapes[geometry].points + i * sizeof(ShapePoint) + 4 * bad,
                        bad < 3 ? point.position[bad] : point.radius, std::numeric_limits<float>::max());
    }
    return {};
  }

  /// Checks that the vertices of moving triangles have times that grow from key to key.
  Check check_times(std::size_t geometry) const {
    const ShapeRecord& shape = view_.shapes[geometry];
    if (shape.kind != ShapeKind::kMovingTriangles) return {};
    const auto points = view_.points_of(geometry);
    for (std::size_t i = 0; i < points.size(); ++i)
      if (const std::size_t vertices = shape.point_count / shape.keys; !has_good_time(points, vertices, i))
        return fail_float(FormatError::kBadShape, shape.points + i * sizeof(ShapePoint) + offsetof(ShapePoint, radius),
                          points[i].radius, points[i % vertices == 0 ? i - vertices : i - i % vertices].radius);
    return {};
  }

  /// Checks that the second point of each segment is a point of the geometry, too, or that corners are vertices.
  Check check_segments(std::size_t geometry) const {
    const ShapeRecord& shape = view_.shapes[geometry];
    const bool moves = shape.kind == ShapeKind::kMovingTriangles;
    const std::uint64_t limit = moves ? shape.point_count / shape.keys : shape.point_count, more = moves ? 0 : 1;
    const auto segments = view_.segments_of(geometry);
    for (std::size_t i = 0; i < segments.size(); ++i)
      if (segments[i] + more >= limit)
        return fail(FormatError::kBadShape, shape.segments + i * sizeof(std::uint32_t), segments[i], limit);
    return {};
  }

  /// Checks that each shape in a leaf lies in its box there.
  Check check_boxes(std::size_t geometry) const {
    const GeometryRecord& record = view_.geometries[geometry];
    if (view_.shapes[geometry].kind == ShapeKind::kNone) return {};
    for (std::size_t i = 0; i < record.primitive_count; ++i) {
      const std::uint32_t slot = view_.primitive_map[record.first_primitive + i];
      if (slot == kInvalidId) continue;
      const Box shape = bounds_of(geometry, i);
      const Box& box = custom_leaf(leaves_[slot / 2]).box[slot % 2];
      // No plane of an empty box is outside.
      const unsigned outside = first_plane_outside(shape, box);
      if (outside == kNoPlane) continue;
      const std::uint64_t at = view_.leaves.offset + std::uint64_t{slot / 2} * sizeof(CustomLeaf) +
                               offsetof(CustomLeaf, box) + sizeof(Box) * (slot % 2) + 4 * outside;
      return fail_plane(FormatError::kBoxNotContained, at, outside, shape, box);
    }
    return {};
  }

  Box bounds_of(std::size_t geometry, std::size_t i) const {
    const ShapeRecord& shape = view_.shapes[geometry];
    const auto points = view_.points_of(geometry);
    const auto numbers = view_.segments_of(geometry);
    if (shape.kind == ShapeKind::kSpheres) return sphere_bounds(points[i]);
    if (shape.kind == ShapeKind::kCurves) return curve_bounds(points[numbers[i]], points[std::size_t{numbers[i]} + 1]);
    return moving_triangle_bounds(points.data(), shape.point_count / shape.keys, shape.keys, &numbers[3 * i]);
  }

  const BufferView& view_;
  std::span<const typename Layout::Leaf> leaves_;
};

}  // namespace

Check check_shapes(const BufferView& view) {
  return dispatch_layout(view.layout(), [&](auto layout) { return ShapeCheck<decltype(layout)>(view).run(); });
}

}  // namespace hiprt::format_detail
