#pragma once
/// Valid scenes of instances of objects that were assembled by hand: instances in parts, and moving ones.

#include "test_scene.h"

#include <hiprt_build/format/view.h>
#include <hiprt_build/instances.h>

#include <initializer_list>
#include <stdexcept>
#include <vector>

namespace hiprt::test {

inline TestFile scene_of(std::initializer_list<std::span<const std::byte>> objects,
                         const std::vector<build::Instance>& group) {
  const std::vector<std::span<const std::byte>> files(objects);
  const auto scene = build::build_instances(files, group);
  if (!scene) throw std::runtime_error(scene.error().message);
  return TestFile(scene->buffer.bytes());
}

/// Instances of one object, all in one place.
inline TestFile instances_of(const TestScene& object, std::size_t count) {
  const TestFile file = object.write();
  return scene_of({file.bytes()},
                  std::vector<build::Instance>(count, {.to_scene = {{{2, 0, 0, 3}, {0, 1, 0, 0}, {0, 0, 1, 0}}}}));
}

inline NodeRef root_of(const TestScene& object) { return object.reference(object.root); }
inline NodeRef node_of(const TestScene& object, std::uint32_t node) {
  return TestScene::make_reference(object.node_at(node), object.box_type());
}
inline NodeRef run_of(const TestScene& object, std::uint32_t leaf) {
  return TestScene::make_reference(object.leaf_at(leaf), 0);
}

/// An instance in parts: leaf i of the scene enters the object at ref i. Only instance 0 of as many is in leaves.
inline TestFile opened_file(const TestScene& object, const std::vector<NodeRef>& refs) {
  TestFile file = instances_of(object, refs.size());
  const BufferView view = *open_buffer(file.bytes());
  for (std::size_t i = 0; i < refs.size(); ++i) {
    const std::uint64_t info = view.leaves.offset + i * sizeof(CustomLeaf) + offsetof(CustomLeaf, info);
    file.put(info, 0u);
    file.put(info + 4, refs[i]);
    file.put(view.primitive_map_entry.offset + 4 * i, i == 0 ? 0u : kInvalidId);
  }
  file.put(view.geometry_entry.offset + offsetof(GeometryRecord, dropped_count), std::uint64_t{refs.size() - 1});
  file.seal();
  return file;
}

/// A chain of box nodes, each with a leaf and the next node, all with one box.
inline TestScene chain_scene(NodeLayout layout, std::uint32_t levels) {
  TestScene scene;
  scene.layout = layout;
  const Box box = row_box(0, 0);
  scene.root = child_node(0, box);
  scene.stack_bound = levels;
  for (std::uint32_t i = 0; i < levels; ++i) {
    scene.nodes.push_back({child_leaves(i, box), i + 1 < levels ? child_node(i + 1, box) : TestChild{}, {}, {}});
    scene.leaves.push_back(row_leaf(0));
    scene.leaves[i].primitive = {2 * i, 2 * i + 1};
    scene.map.push_back(2 * i);
    scene.map.push_back(2 * i + 1);
  }
  scene.geometries = {{0, 2 * levels, 0, 0xffffffffu, 0}};
  return scene;
}

/// The chain's node at a level, and all leaves above it.
inline std::vector<NodeRef> chain_parts(const TestScene& chain, std::uint32_t level) {
  std::vector<NodeRef> refs{node_of(chain, level)};
  for (std::uint32_t i = 0; i < level; ++i) refs.push_back(run_of(chain, i));
  return refs;
}

/// One instance that stands still, and one that moves.
inline TestFile moving_pair(NodeLayout layout, const build::Motion& motion) {
  const TestFile object = root_leaf_scene(layout).write();
  return scene_of({object.bytes()}, {{}, {.motion = &motion}});
}
/// From time 0 through a turn at time 1 to another at time 3.
inline TestFile turning_file(NodeLayout layout, MotionKind kind) {
  return moving_pair(layout, {.keys = {{.time = 0, .translation = {1, 2, 3}},
                                       {.time = 1, .rotation = {0, 0, 1, 1}},
                                       {.time = 3, .rotation = {1, 0, 0, 1}}},
                              .kind = kind});
}
inline TestFile slerp_file(NodeLayout layout) { return turning_file(layout, MotionKind::kSlerp); }
inline TestFile nlerp_file(NodeLayout layout) { return turning_file(layout, MotionKind::kNlerp); }
inline TestFile matrix_file(NodeLayout layout) { return turning_file(layout, MotionKind::kMatrix); }

/// Hidden at the first key, at the last one, or at the last two.
inline TestFile hidden_first_file(NodeLayout layout) {
  return moving_pair(layout, {.keys = {{.time = 0, .scale = {0, 0, 0}}, {.time = 1}}});
}
inline TestFile hidden_last_file(NodeLayout layout) {
  return moving_pair(layout, {.keys = {{.time = 0}, {.time = 1, .scale = {0, 0, 0}}}});
}
inline TestFile hidden_twice_file(NodeLayout layout) {
  return moving_pair(layout, {.keys = {{.time = 0}, {.time = 1, .scale = {0, 0, 0}}, {.time = 2, .scale = {0, 0, 0}}}});
}

/// One instance, which moves along all axes: its tree is one leaf.
inline TestFile sliding(NodeLayout layout, float direction) {
  const TestFile object = root_leaf_scene(layout).write();
  const build::Motion motion{
      .keys = {{.time = 0}, {.time = 1, .translation = {direction, 2 * direction, 3 * direction}}}};
  return scene_of({object.bytes()}, {{.motion = &motion}});
}
inline TestFile sliding_file(NodeLayout layout) { return sliding(layout, 1); }
inline TestFile sliding_back_file(NodeLayout layout) { return sliding(layout, -1); }

}  // namespace hiprt::test
