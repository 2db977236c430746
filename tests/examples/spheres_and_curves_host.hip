// What the host does for spheres_and_curves.hip: a scene from their boxes, and the launch.

#include <hiprt_build/build.h>

#include <vector>

#include "spheres_and_curves.hip"

/// Geometry 0: the spheres. Geometry 1: segment i is the curve from vertices[first_vertex[i]] to the vertex behind it.
hiprt::build::Result<hiprt::build::Bvh> build_spheres_and_curves(std::span<const hiprt::Sphere> spheres,
                                                                 std::span<const hiprt::CurveVertex> vertices,
                                                                 std::span<const std::uint32_t> first_vertex) {
  std::vector<hiprt::Box> sphere_boxes, curve_boxes;
  for (const hiprt::Sphere& sphere : spheres) sphere_boxes.push_back(hiprt::SphereSet::bounds(sphere));
  for (const std::uint32_t first : first_vertex)
    curve_boxes.push_back(hiprt::RoundCurveSet::bounds(vertices[first], vertices[first + 1]));
  const hiprt::build::CustomGeometry geometries[] = {{sphere_boxes, 0}, {curve_boxes, 1}};  // Boxes, type.
  return hiprt::build::build(hiprt::build::SceneInput{{}, geometries});
}

/// All pointers are the device's: copies of the data from which the boxes were made.
void launch_spheres_and_curves(const hiprt::SceneView& scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count,
                               const hiprt::Sphere* spheres, const hiprt::CurveVertex* vertices,
                               const std::uint32_t* first_vertex) {
  const SpheresAndCurves primitives{hiprt::SphereSet{spheres}, hiprt::RoundCurveSet{vertices, first_vertex}};
  hipLaunchKernelGGL(trace_spheres_and_curves, dim3((count + 63) / 64), dim3(64), 0, nullptr, scene, rays, hits, count,
                     primitives);
}
