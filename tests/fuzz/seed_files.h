#pragma once
/// BVH files that the fuzzer starts from: all layouts, shapes, instances and motion.

#include "../format/shape_files.h"
#include "../format/test_scene.h"

#include <stdexcept>
#include <vector>

namespace hiprt::fuzz {

using test::custom_root_scene, test::custom_scene, test::empty_scene, test::far_scene, test::root_leaf_scene,
    test::row_scene;
using test::shape_file, test::shape_scene_file, test::split_scene;
using test::TestFile, test::TestScene;

/// Two levels: groups of a triangle's instances. One in each group moves.
inline TestFile moving_file(NodeLayout layout, MotionKind kind) {
  const std::vector<build::Position> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<build::Triangle> triangles{{0, 1, 2}};
  const build::TriangleMesh meshes[] = {{positions, triangles}};
  const auto mesh = build::build(meshes, {.nodes = layout});
  if (!mesh) throw std::runtime_error(mesh.error().message);
  const build::Motion motion{.keys = {{.time = 0},
                                      {.time = 0.5f, .translation = {1, 2, 3}, .rotation = {0, 0, 1, 1}},
                                      {.time = 1, .scale = {2, 1, 1}, .shear = {0.5f, 0, 0}}},
                             .kind = kind};
  const std::span<const std::byte> files[] = {mesh->buffer.bytes()};
  const std::vector<build::Instance> twig{{.object = 0}, {.object = 0, .motion = &motion}},
      tree{{.object = 1, .id = 7}, {.object = 1, .mask = 3, .motion = &motion}};
  const std::vector<std::span<const build::Instance>> groups{twig, tree};
  const auto scene = build::build_instances(build::InstancedScene{files, groups});
  if (!scene) throw std::runtime_error(scene.error().message);
  return TestFile(scene->buffer.bytes());
}

/// The file of each kind.
inline std::vector<TestFile> make_bvh_files() {
  std::vector<TestScene> scenes{far_scene()};
  for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized})
    for (auto* make : {row_scene, split_scene, root_leaf_scene, empty_scene, custom_scene, custom_root_scene})
      scenes.push_back(make(layout));
  std::vector<TestFile> files;
  for (const TestScene& scene : scenes) files.push_back(scene.write());
  for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized})
    for (auto* make : {shape_file, shape_scene_file}) files.push_back(make(layout));
  for (const MotionKind kind : {MotionKind::kSlerp, MotionKind::kNlerp, MotionKind::kMatrix})
    files.push_back(moving_file(NodeLayout::kPlanes, kind));
  files.push_back(moving_file(NodeLayout::kQuantized, MotionKind::kSlerp));
  return files;
}

}  // namespace hiprt::fuzz
