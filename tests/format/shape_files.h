#pragma once
/// Small files with shapes, made by the builder.

#include "test_file.h"

#include <hiprt_build/instances.h>
#include <hiprt_build/shapes.h>

#include <stdexcept>
#include <utility>
#include <vector>

namespace hiprt::test {

/// Geometry 0: a triangle. 1: two spheres and one of radius 0. 2: two strands of two segments and one, and one without
/// size. 3: a box of the program's own. 4: two triangles of four vertices with three keys.
inline TestFile shape_file(NodeLayout layout) {
  const std::vector<build::Position> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<build::Triangle> triangles{{0, 1, 2}};
  const std::vector<ShapePoint> balls{{{3, 0, 0}, 1}, {{6, 0, 0}, 0.5f}, {{9, 0, 0}, 0}};
  const std::vector<ShapePoint> axes{{{0, 3, 0}, 0.25f}, {{0, 4, 0}, 0.125f}, {{0, 5, 1}, 0}, {{4, 4, 0}, 0.5f},
                                     {{5, 4, 0}, 0.5f},  {{9, 9, 9}, 0},      {{9, 9, 8}, 0}};
  const std::vector<std::uint32_t> of_strands{3, 2, 2};
  const auto segments = build::strand_segments(of_strands);
  const build::Shapes spheres{ShapeKind::kSpheres, balls, {}}, curves{ShapeKind::kCurves, axes, segments};
  const auto sphere_boxes = build::shape_boxes(spheres), curve_boxes = build::shape_boxes(curves);
  const std::vector<Box> own{{{-3, -3, -3}, {-2, -2, -2}}};
  std::vector<ShapePoint> vertices;
  for (const float z : {0.0f, 1.0f, 3.0f})
    for (const auto& [x, y] : {std::pair{0.0f, 0.0f}, {1.0f, 0.0f}, {1.0f, 1.0f}, {0.0f, 1.0f}})
      vertices.push_back({{x, y - 5, z}, z});
  const std::vector<std::uint32_t> corners{0, 1, 2, 0, 2, 3};
  const build::Shapes moving{ShapeKind::kMovingTriangles, vertices, corners, 3};
  const auto moving_boxes = build::shape_boxes(moving);
  if (!moving_boxes || !sphere_boxes || !curve_boxes) throw std::runtime_error("boxes of shapes");
  const build::TriangleMesh meshes[] = {{positions, triangles}};
  const build::CustomGeometry customs[] = {{.boxes = *sphere_boxes, .shapes = spheres},
                                           {.boxes = *curve_boxes, .type = 1, .shapes = curves},
                                           {.boxes = own},
                                           {.boxes = *moving_boxes, .type = 2, .shapes = moving}};
  const auto bvh = build::build(build::SceneInput{meshes, customs}, {.nodes = layout});
  if (!bvh) throw std::runtime_error(bvh.error().message);
  return TestFile(bvh->buffer.bytes());
}

/// Two instances of that, and one of a triangle.
inline TestFile shape_scene_file(NodeLayout layout) {
  const std::vector<build::Position> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<build::Triangle> triangles{{0, 1, 2}};
  const build::TriangleMesh meshes[] = {{positions, triangles}};
  const auto mesh = build::build(meshes, {.nodes = layout});
  if (!mesh) throw std::runtime_error(mesh.error().message);
  const TestFile shapes = shape_file(layout);
  const std::span<const std::byte> files[] = {mesh->buffer.bytes(), shapes.bytes()};
  const std::vector<build::Instance> group{
      {.object = 1}, {.object = 1, .to_scene = {{{1, 0, 0, 20}, {0, 2, 0, 0}, {0, 0, 1, 0}}}}, {.object = 0}};
  const auto scene = build::build_instances(files, group);
  if (!scene) throw std::runtime_error(scene.error().message);
  return TestFile(scene->buffer.bytes());
}

}  // namespace hiprt::test
