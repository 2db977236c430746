#pragma once
/// Shapes: custom primitives that the file defines. Normative text: hiprt_device/docs/FORMAT.md. Reasons:
/// hiprt_device/docs/decisions/0016-shapes-in-files.md. primitives/scene_shapes.h intersects them.

#include <hiprt_device/format/node.h>

namespace hiprt {

/// The kind of a geometry's primitives.
enum class ShapeKind : std::uint32_t {
  kNone = 0,             ///< Triangles, or custom primitives that only the program knows.
  kSpheres = 1,          ///< Primitive i is the sphere of point i.
  kCurves = 2,           ///< Primitive i is the round linear curve from point segment[i] to the next one.
  kMovingTriangles = 3,  ///< Primitive i is a triangle whose corners move: vertices segment[3 i] to segment[3 i + 2].
};

/// Numbers that kCurveSegments holds per primitive.
HIPRT_HD constexpr std::uint32_t segment_numbers(ShapeKind kind) {
  return kind == ShapeKind::kCurves ? 1 : kind == ShapeKind::kMovingTriangles ? 3 : 0;
}

/// A sphere, a point of a curve's axis, or a vertex at one time.
struct ShapePoint {
  float position[3];  ///< Finite.
  float radius;       ///< Finite, at least 0. Of a vertex: its time, finite.
};

/// The points of one geometry. Record i belongs to geometry i.
struct ShapeRecord {
  std::uint64_t points;  ///< Offset in the file of the geometry's first ShapePoint; 0: it has no shapes.
  /// kCurves: offset in the file of its first segment's number. kMovingTriangles: of its first vertex number. Else 0.
  std::uint64_t segments;
  std::uint32_t point_count;  ///< Number of points, one after the other.
  ShapeKind kind;
  /// kMovingTriangles: times at which the vertices are stated, each later than the one before, 2 or more. The points of
  /// one time follow each other. Else 0.
  std::uint32_t keys;
  std::uint32_t reserved;
};

static_assert(sizeof(ShapePoint) == 16 && sizeof(ShapeRecord) == 32);
#if !HIPRT_RUN_TIME_COMPILER  // Run-time compilers have no offsetof.
static_assert(offsetof(ShapePoint, position) == 0 && offsetof(ShapePoint, radius) == 12);
static_assert(offsetof(ShapeRecord, points) == 0 && offsetof(ShapeRecord, segments) == 8);
static_assert(offsetof(ShapeRecord, point_count) == 16 && offsetof(ShapeRecord, kind) == 20);
static_assert(offsetof(ShapeRecord, keys) == 24 && offsetof(ShapeRecord, reserved) == 28);
#endif

namespace shape_detail {

/// These functions compare bits, which fast-math does not change.
HIPRT_HD HIPRT_FORCE_INLINE bool is_finite(float a) {
  return (std::bit_cast<std::uint32_t>(a) & 0x7f800000u) != 0x7f800000u;
}
HIPRT_HD HIPRT_FORCE_INLINE bool is_finite(const float (&a)[3]) {
  return is_finite(a[0]) && is_finite(a[1]) && is_finite(a[2]);
}

/// The float next to a finite float.
HIPRT_HD HIPRT_FORCE_INLINE float next_after(float a, bool up) {
  if (a == 0.0f) return up ? 0x1p-149f : -0x1p-149f;
  const auto bits = std::bit_cast<std::uint32_t>(a);
  return std::bit_cast<float>((a > 0.0f) == up ? bits + 1u : bits - 1u);
}

/// center - radius rounded down, or center + radius rounded up.
HIPRT_HD HIPRT_FORCE_INLINE float side(float center, float radius, bool up) {
  const float step = up ? radius : -radius;
  const float sum = center + step;
  if (!is_finite(sum)) return sum;
  // TwoSum (Knuth): the rounding error of the sum, exactly.
  const float added = sum - center;
  const float error = (center - (sum - added)) + (step - added);
  return (up ? error > 0.0f : error < 0.0f) ? next_after(sum, up) : sum;
}

/// The box of a shape that is never hit.
HIPRT_HD HIPRT_FORCE_INLINE Box empty_box() {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  return {{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
}

/// The smallest box of floats around a ball; infinite beyond the largest float.
HIPRT_HD HIPRT_FORCE_INLINE Box ball_bounds(const float (&center)[3], float radius) {
  return {{side(center[0], radius, false), side(center[1], radius, false), side(center[2], radius, false)},
          {side(center[0], radius, true), side(center[1], radius, true), side(center[2], radius, true)}};
}

/// Whether a ShapePoint is allowed.
HIPRT_HD HIPRT_FORCE_INLINE bool is_valid(const ShapePoint& point) {
  return is_finite(point.position) && point.radius >= 0.0f && is_finite(point.radius);
}

/// Whether a point of this kind of shapes is allowed: vertices have any finite time in place of a radius.
HIPRT_HD HIPRT_FORCE_INLINE bool is_valid(const ShapePoint& point, ShapeKind kind) {
  return kind == ShapeKind::kMovingTriangles ? is_finite(point.position) && is_finite(point.radius) : is_valid(point);
}

/// Whether a curve between two points is ever hit.
HIPRT_HD HIPRT_FORCE_INLINE bool is_valid(const ShapePoint& a, const ShapePoint& b) {
  return is_valid(a) && is_valid(b) && (a.radius > 0.0f || b.radius > 0.0f);
}

/// Adds a corner of a moving triangle at one of its keys. A coordinate between two equal ones may be off by 2 units.
HIPRT_HD HIPRT_FORCE_INLINE void grow_by_corner(Box& box, const float* position) {
  for (int axis = 0; axis < 3; ++axis) {
    const float at = position[axis], slack = 0x1p-22f * (at < 0.0f ? -at : at) + 0x1p-148f;
    if (at - slack < box.min[axis]) box.min[axis] = at - slack;
    if (at + slack > box.max[axis]) box.max[axis] = at + slack;
  }
}

}  // namespace shape_detail

/// The smallest box of floats around a sphere; empty for one that is never hit, as its radius is 0.
HIPRT_HD HIPRT_FORCE_INLINE Box sphere_bounds(const ShapePoint& point) {
  using namespace shape_detail;
  return is_valid(point) && point.radius > 0.0f ? ball_bounds(point.position, point.radius) : empty_box();
}

/// The smallest box of floats around a round linear curve; empty for one that is never hit, as both radii are 0.
HIPRT_HD HIPRT_FORCE_INLINE Box curve_bounds(const ShapePoint& a, const ShapePoint& b) {
  using namespace shape_detail;
  if (!is_valid(a, b)) return empty_box();
  Box box = ball_bounds(a.position, a.radius);
  const Box other = ball_bounds(b.position, b.radius);
  for (int axis = 0; axis < 3; ++axis) {
    box.min[axis] = box.min[axis] < other.min[axis] ? box.min[axis] : other.min[axis];
    box.max[axis] = box.max[axis] > other.max[axis] ? box.max[axis] : other.max[axis];
  }
  return box;
}

/// Whether point i of moving triangles has the time of its key, and that is later than the key before.
/// @param vertices of a key.
template <class Points> HIPRT_HD bool has_good_time(const Points& points, std::size_t vertices, std::size_t i) {
  if (i % vertices != 0) return points[i].radius == points[i - i % vertices].radius;
  return i == 0 || points[i].radius > points[i - vertices].radius;
}

/// A box around a moving triangle at all times.
/// @param points [keys * vertices]. @param corners three vertex numbers.
HIPRT_HD HIPRT_FORCE_INLINE Box moving_triangle_bounds(const ShapePoint* points, std::uint32_t vertices,
                                                       std::uint32_t keys, const std::uint32_t* corners) {
  Box box = shape_detail::empty_box();
  for (std::uint32_t key = 0; key < keys; ++key)
    for (unsigned k = 0; k < 3; ++k)
      shape_detail::grow_by_corner(box, points[std::uint64_t{key} * vertices + corners[k]].position);
  return box;
}

}  // namespace hiprt
