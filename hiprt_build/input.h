#pragma once
/// What a builder takes.

#include <hiprt_device/format/node.h>
#include <hiprt_device/format/shape.h>

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

namespace hiprt::build {

/// A vertex: x, y, z.
using Position = std::array<float, 3>;
/// Three indices of positions.
using Triangle = std::array<std::uint32_t, 3>;

/// An indexed triangle mesh; becomes one geometry. The spans are read during build() only.
/// Triangles with a NaN or infinite corner, or with two corners at the same position, are dropped: they keep their
/// number but no ray hits them, and they are counted (BuildStatistics). Zero-area triangles with three distinct corners
/// stay, because they can close a gap between neighbours.
struct TriangleMesh {
  std::span<const Position> positions;  ///< Fewer than 2^31.
  std::span<const Triangle> triangles;  ///< Indices below positions.size(). Fewer than 2^30; of all meshes, than 2^31.
  std::uint32_t mask = 0xffffffffu;     ///< A ray sees the mesh iff (ray.mask & mask) != 0.
  std::string_view name{};              ///< For the provenance block.
};

/// Spheres or round linear curves. The spans are read during build() only.
struct Shapes {
  ShapeKind kind = ShapeKind::kNone;
  std::span<const ShapePoint> points{};  ///< Fewer than 2^32. Finite, radii at least 0.
  /// kCurves: segment i is the curve from points[segments[i]] to the point behind it. Segments of one strand name its
  /// points one after the other, but for the last. kSpheres: empty, sphere i is that of points[i].
  std::span<const std::uint32_t> segments{};

  std::size_t size() const { return kind == ShapeKind::kCurves ? segments.size() : points.size(); }
  /// The smallest box of floats around primitive @p i; inverted for one that is never hit (radius 0).
  Box bounds(std::size_t i) const {
    return kind == ShapeKind::kCurves ? curve_bounds(points[segments[i]], points[std::size_t{segments[i]} + 1])
                                      : sphere_bounds(points[i]);
  }
};

/// Custom primitives: what they are the program knows (its intersection functions, found by type), or the file says
/// (shapes); becomes one geometry. The spans are read during build() only.
/// Boxes with NaN or infinite coordinates, or with min > max, are dropped as degenerate triangles are. A box must hold
/// all points at which the program's function may report a hit.
struct CustomGeometry {
  std::span<const Box> boxes;        ///< Primitive i is in boxes[i]. With all primitives of the scene fewer than 2^31.
  std::uint8_t type = 0;             ///< The program's own number for what the primitives are.
  std::uint32_t mask = 0xffffffffu;  ///< A ray sees the geometry iff (ray.mask & mask) != 0.
  std::string_view name{};           ///< For the provenance block.
  /// What the primitives are, for the file, so that a tracer needs nothing else (SceneShapes): as many as boxes, which
  /// are theirs or larger (shape_boxes() of shapes.h). Default: the file has the boxes only.
  Shapes shapes{};
};

/// Everything in one BVH: meshes[i] becomes geometry i, customs[i] geometry meshes.size() + i.
struct SceneInput {
  std::span<const TriangleMesh> meshes{};
  std::span<const CustomGeometry> customs{};
};

}  // namespace hiprt::build
