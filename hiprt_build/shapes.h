#pragma once
/// Spheres and curves for a build.
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

/// The smallest boxes of floats around shapes, for CustomGeometry::boxes. Those of primitives that are never hit (of
/// radius 0) are inverted, so that build() drops them.
/// @param threads 0, or more than there are: all that the process may use.
/// @return kInvalidInput with the number of the point or segment: a coordinate or radius that is not finite, a negative
/// radius, a segment whose second point is none, segments of spheres. kTooLarge for 2^32 points or more. kOutOfMemory.
HIPRT_BUILD_API Result<std::vector<Box>> shape_boxes(const Shapes& shapes, unsigned threads = 0);

/// The segments of strands that lie in an array one after the other: of each, its points but for the last.
/// @param points of each strand. @return as many numbers as all strands have points, less one each.
HIPRT_BUILD_API std::vector<std::uint32_t> strand_segments(std::span<const std::uint32_t> points);

}  // namespace hiprt::build
