#pragma once
/// The input of a builder: meshes and custom primitives.

#include <hiprt_build/strided_span.h>
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
/// Two triangles of a mesh, by number, that are to share a leaf. Equal numbers: one triangle alone.
using TrianglePair = std::array<std::uint32_t, 2>;

/// A triangle mesh. It becomes one geometry. build() reads the spans and does not keep them.
/// The builder drops triangles with a NaN or infinite corner, or with two corners at the same position. Dropped
/// triangles keep their number, no ray hits them, and BuildStatistics counts them. Triangles without area but with
/// three distinct corners stay, because they can close a gap between neighbours.
struct TriangleMesh {
  StridedSpan<Position> positions{};  ///< Fewer than 2^31.
  /// Indices below positions.size(). Fewer than 2^30; of all meshes, than 2^31. Positions without triangles are an
  /// error, unless implicit_triangles is set.
  StridedSpan<Triangle> triangles{};
  std::uint32_t mask = 0xffffffffu;  ///< A ray sees the mesh iff (ray.mask & mask) != 0.
  std::string_view name{};           ///< For the provenance block.
  std::uint32_t type = 0;            ///< The program's own number, up to kMaxGeometryType: FilterQuestions::type().
  /// Triangle i has the positions 3 i, 3 i + 1 and 3 i + 2, and triangles is empty. The number of positions is a
  /// multiple of 3.
  bool implicit_triangles = false;
  /// If not empty, the leaves: these pairs, and each other triangle alone. A triangle is in one pair at most. Two
  /// triangles without a common edge get a leaf each; so do two that run through it in the same direction. Builders
  /// that split triangles may separate a pair.
  std::span<const TrianglePair> pairs{};
};

/// Spheres, round linear curves, or triangles that move. build() reads the spans and does not keep them.
struct Shapes {
  ShapeKind kind = ShapeKind::kNone;
  std::span<const ShapePoint> points{};  ///< Fewer than 2^32. Finite, radii at least 0 (times may be less).
  /// kCurves: segment i runs from points[segments[i]] to the next point. The segments of a strand name all its points
  /// except the last. kMovingTriangles: three vertices of each triangle. kSpheres: empty, sphere i is points[i].
  std::span<const std::uint32_t> segments{};
  /// kMovingTriangles: at how many times the vertices are stated, 2 or more. The vertices of one time follow each other
  /// in points, and that time is their radius. Times grow. Else 0.
  std::uint32_t keys = 0;

  std::size_t size() const {
    return kind == ShapeKind::kCurves            ? segments.size()
           : kind == ShapeKind::kMovingTriangles ? segments.size() / 3
                                                 : points.size();
  }
  /// A box around primitive @p i: of spheres and curves the smallest one of floats, and inverted for one that is never
  /// hit (radius 0).
  Box bounds(std::size_t i) const {
    if (kind == ShapeKind::kCurves) return curve_bounds(points[segments[i]], points[std::size_t{segments[i]} + 1]);
    if (kind != ShapeKind::kMovingTriangles) return sphere_bounds(points[i]);
    return moving_triangle_bounds(points.data(), static_cast<std::uint32_t>(points.size() / keys), keys,
                                  &segments[3 * i]);
  }
};

/// Custom primitives. They form one geometry. Their shape is known to the program (an intersection function per type)
/// or to the file (shapes). build() reads the spans and does not keep them.
/// The builder drops boxes with NaN or infinite coordinates, or with min > max, as it drops degenerate triangles. A box
/// must contain all points at which the program's function may report a hit.
struct CustomGeometry {
  BoxSpan boxes{};                   ///< Primitive i is in boxes[i]. With all primitives of the scene fewer than 2^31.
  std::uint32_t type = 0;            ///< The program's own number, up to kMaxGeometryType: selects the functor.
  std::uint32_t mask = 0xffffffffu;  ///< A ray sees the geometry iff (ray.mask & mask) != 0.
  std::string_view name{};           ///< For the provenance block.
  /// The shapes of the primitives, for the file, so that a tracer needs nothing else (SceneShapes). One per box; each
  /// box contains its shape (shape_boxes() of shapes.h). Default: the file has the boxes only.
  Shapes shapes{};
};

/// All geometries of one BVH: meshes[i] becomes geometry i, customs[i] becomes geometry meshes.size() + i.
struct SceneInput {
  std::span<const TriangleMesh> meshes{};
  std::span<const CustomGeometry> customs{};
};

}  // namespace hiprt::build
