#pragma once
/// A part of a scene: the BVH file that data of parts must fit, and such data.

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/instances.h>
#include <hiprt_build/shapes.h>
#include <tools/parts/part_data.h>
#include <tools/parts/part_manifest.h>

#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace hiprt::fuzz {

/// Two instances of a group with an instance of two triangles, and one of the same that move.
inline build::Buffer part_bvh() {
  const std::vector<build::Position> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  const std::vector<build::Triangle> triangles{{0, 1, 2}, {1, 3, 2}};
  const build::TriangleMesh meshes[] = {{positions, triangles}};
  auto mesh = build::build(meshes);
  if (!mesh) throw std::runtime_error(mesh.error().message);
  const std::vector<ShapePoint> points{{{0, 0, 0}, 0}, {{1, 0, 0}, 0}, {{0, 1, 0}, 0}, {{1, 1, 0}, 0},
                                       {{0, 0, 0}, 1}, {{1, 0, 1}, 1}, {{0, 1, 0}, 1}, {{1, 1, 1}, 1}};
  const std::vector<std::uint32_t> corners{0, 1, 2, 1, 3, 2};
  const build::Shapes shapes{ShapeKind::kMovingTriangles, points, corners, 2};
  const auto boxes = build::shape_boxes(shapes);
  if (!boxes) throw std::runtime_error(boxes.error().message);
  const build::CustomGeometry customs[] = {{.boxes = *boxes, .shapes = shapes}};
  auto moving = build::build(build::SceneInput{.customs = customs});
  if (!moving) throw std::runtime_error(moving.error().message);
  const std::span<const std::byte> files[] = {std::as_const(mesh->buffer).bytes(),
                                              std::as_const(moving->buffer).bytes()};
  const std::vector<build::Instance> group{{.object = 0}, {.object = 1, .id = 1}}, scene{{.object = 2}, {.object = 2}};
  const std::vector<std::span<const build::Instance>> groups{group, scene};
  auto bvh = build::build_instances(build::InstancedScene{files, groups});
  if (!bvh) throw std::runtime_error(bvh.error().message);
  return std::move(bvh->buffer);
}

/// A part as a manifest describes it.
inline tools::ScenePart described_part() {
  return {{"a.bvh", 9, std::string(32, '0')},
          {"a.data", 5, std::string(32, 'f')},
          2,
          {{0, 0, 0}, {1, 2, 3}},
          1.5f,
          2.0f,
          {{{0, 0, 0}, {1, 1, 1}}}};
}

/// Data with everything that a part can have.
inline tools::PartData part_data() {
  tools::PartData data{{{1, 5}, {0, 7}}, tools::SceneSurfaces{}};
  tools::SceneSurfaces& surfaces = *data.surfaces;
  surfaces.textures.push_back({"", 2, 1, {0xff0000ffu, 0x8000ff00u}});
  surfaces.materials.emplace_back().base_color_texture.texture = 0;
  tools::GeometrySurface surface;
  surface.triangles = {{0, 1, 2}, {1, 3, 2}};
  surface.materials = {0, 0};
  surface.coordinates = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  surface.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
  surfaces.objects.push_back({surface});
  surface.times = {0, 1};
  surface.normals.resize(8, {0.6f, 0, 0.8f});
  surfaces.objects.push_back({surface});
  return data;
}

}  // namespace hiprt::fuzz
