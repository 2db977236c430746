#pragma once
/// Spheres, curves and moving triangles for a build.
///
///     const hiprt::build::Shapes hair{.kind = hiprt::ShapeKind::kCurves, .points = points, .segments = segments};
///     const auto boxes = hiprt::build::shape_boxes(hair);
///     const hiprt::build::CustomGeometry geometries[] = {{.boxes = *boxes, .shapes = hair}};
///     const auto bvh = hiprt::build::build(hiprt::build::SceneInput{.customs = geometries});

#include <hiprt_build/error.h>
#include <hiprt_build/input.h>

#include <cstdint>
#include <span>
#include <vector>

namespace hiprt::build {

/// @return boxes around shapes, for CustomGeometry::boxes; of spheres and curves the smallest ones of floats. Boxes of
/// primitives that are never hit (radius 0) are inverted, so that build() drops them. Errors: kTooLarge for 2^32 points
/// or more, kOutOfMemory, or kInvalidInput with the number of the point, segment or triangle. kInvalidInput means a
/// coordinate or radius that is not finite, or a negative radius. Or there is a segment without a second point, a
/// corner that is no vertex, a time that does not grow, or an unknown kind. Or numbers do not fit: segments of spheres,
/// keys.
/// @param threads 0, or more than the process may use: all of them.
HIPRT_BUILD_API Result<std::vector<Box>> shape_boxes(const Shapes& shapes, unsigned threads = 0);

/// @return the segments of strands whose points lie in one array: the numbers of all points except the last of each
/// strand.
/// @param points how many points each strand has.
HIPRT_BUILD_API std::vector<std::uint32_t> strand_segments(std::span<const std::uint32_t> points);

}  // namespace hiprt::build
