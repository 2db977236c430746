#pragma once
/// The scenes of the format tests, in any layout.

#include "test_file.h"

namespace hiprt::test {

/// The box of the squares @p first to @p last of row_scene().
inline Box row_box(unsigned first, unsigned last) {
  return {{2.0f * static_cast<float>(first), 0, 0}, {2.0f * static_cast<float>(last) + 1, 1, 0}};
}

inline TestLeaf row_leaf(unsigned i) {
  const float x = 2.0f * static_cast<float>(i);
  return {.vertex = {{{x, 0, 0}, {x + 1, 0, 0}, {x, 1, 0}, {x + 1, 1, 0}}}};
}

/// The scene of the golden files that are named after layouts: see golden/make_golden.py. Those of the layouts that
/// version 1.0 had say so.
inline TestScene row_scene(NodeLayout layout) {
  TestScene scene;
  scene.layout = layout;
  scene.version_minor = layout == NodeLayout::kFloat || layout == NodeLayout::kPlanes ? 0 : 1;
  scene.root = child_node(0, row_box(0, 3));
  scene.stack_bound = 2;
  scene.features = 3;
  scene.nodes = {{child_leaves(0, row_box(0, 1)), {}, child_node(1, row_box(2, 3)), {}},
                 {TestChild{}, child_leaves(2, row_box(2, 2)), {}, child_leaves(3, row_box(3, 3))}};
  scene.leaves = {row_leaf(0), row_leaf(1), row_leaf(2), row_leaf(3)};
  scene.leaves[0].primitive = {0, 1};
  scene.leaves[0].last = false;
  scene.leaves[1].primitive = {2, 3};
  scene.leaves[2].primitive = {5, 0xffffffffu};
  scene.leaves[2].vertex[3] = scene.leaves[2].vertex[2];
  scene.leaves[2].id = {0x89, 0};
  scene.leaves[3].primitive = {1, 0};
  scene.leaves[3].geometry = 1;
  scene.leaves[3].id = {0x84, 0x82};
  scene.map = {0, 1, 2, 3, 0xffffffffu, 4, 7, 6};
  scene.geometries = {{0, 6, 1, 0xffffffffu, 0}, {6, 2, 0, 2, 0}};
  scene.provenance =
      "{\"tool\": \"make_golden.py\", \"note\": \"gr\xc3\xbc\xc3\x9f"
      "e\"}";
  return scene;
}

/// One triangle (0,0,0) (4,0,0) (0,4,0) split at x = 2 into two leaves; the second copy is stored rotated by 1.
inline TestScene split_scene(NodeLayout layout) {
  TestScene scene;
  scene.layout = layout;
  const Box left{{0, 0, 0}, {2, 4, 0}}, right{{2, 0, 0}, {4, 2, 0}};
  scene.root = child_node(0, {{0, 0, 0}, {4, 4, 0}});
  scene.stack_bound = 1;
  scene.features = 5;
  scene.nodes = {{child_leaves(0, left), child_leaves(1, right), {}, {}}};
  scene.leaves = {
      {.vertex = {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {0, 4, 0}}}, .primitive = {0, 0xffffffffu}, .id = {0x89, 0}},
      {.vertex = {{{4, 0, 0}, {0, 4, 0}, {0, 0, 0}, {0, 0, 0}}}, .primitive = {0, 0xffffffffu}, .id = {0x84, 0}}};
  scene.map = {0};
  scene.geometries = {{0, 1, 0, 0xffffffffu, 0}};
  return scene;
}

/// One leaf and no box node.
inline TestScene root_leaf_scene(NodeLayout layout) {
  TestScene scene;
  scene.layout = layout;
  scene.root = child_leaves(0, row_box(0, 0));
  scene.leaves = {row_leaf(0)};
  scene.leaves[0].primitive = {0, 1};
  scene.map = {0, 1};
  scene.geometries = {{0, 2, 0, 0xffffffffu, 0}};
  return scene;
}

inline TestLeaf custom_leaf(std::array<std::uint32_t, 2> primitive, const Box& first, const Box& second = kEmpty) {
  TestLeaf leaf;
  leaf.primitive = primitive;
  leaf.geometry = 1;
  leaf.id = {0xc0, static_cast<std::uint8_t>(primitive[1] == 0xffffffffu ? 0 : 0xc0)};
  leaf.custom = true;
  leaf.box = {first, second};
  return leaf;
}

/// Two triangles and six custom primitives of type 7, one of them dropped: see golden/make_golden.py, custom.bvh.
inline TestScene custom_scene(NodeLayout layout) {
  TestScene scene;
  scene.layout = layout;
  const Box near{{2, 0, 0}, {3.5f, 1.5f, 1}}, far{{4, 0, 0}, {7, 1, 1}};
  scene.root = child_node(0, {{0, 0, 0}, {7, 1.5f, 1}});
  scene.stack_bound = 2;
  scene.features = 9;
  scene.nodes = {{child_node(1, {{0, 0, 0}, {3.5f, 1.5f, 1}}, 1), {}, child_customs(2, far), {}},
                 {TestChild{}, child_leaves(0, row_box(0, 0)), {}, child_customs(1, near)}};
  scene.leaves = {row_leaf(0), custom_leaf({0, 1}, {{2, 0, 0}, {3, 1, 1}}, {{2.5f, 0.5f, 0}, {3.5f, 1.5f, 1}}),
                  custom_leaf({3, 0xffffffffu}, {{4, 0, 0}, {5, 1, 1}}),
                  custom_leaf({5, 4}, {{6, 0, 0}, {7, 1, 1}}, {{6, 0, 0}, {6, 0, 0}})};
  scene.leaves[0].primitive = {0, 1};
  scene.leaves[2].last = false;
  scene.map = {0, 1, 2, 3, 0xffffffffu, 4, 7, 6};
  scene.geometries = {{0, 2, 0, 0xffffffffu, 0}, {2, 6, 1, 0xffffffffu, 0x0701}};
  return scene;
}

/// One custom leaf and no box node.
inline TestScene custom_root_scene(NodeLayout layout) {
  TestScene scene;
  scene.layout = layout;
  scene.features = 8;
  scene.root = child_customs(0, {{0, 0, 0}, {1, 1, 1}});
  scene.leaves = {custom_leaf({0, 0xffffffffu}, {{0, 0, 0}, {1, 1, 1}})};
  scene.leaves[0].geometry = 0;
  scene.map = {0};
  scene.geometries = {{0, 1, 0, 0xffffffffu, 1}};
  return scene;
}

/// Leaf 0 and 1 of row_scene() moved beyond the largest half on either side of x, with infinite planes in layout half.
inline TestScene far_scene() {
  TestScene scene;
  scene.layout = NodeLayout::kHalf;
  scene.root = child_node(0, {{-1e6f, 0, 0}, {1e30f, 1, 0}});
  scene.stack_bound = 1;
  scene.nodes = {
      {child_leaves(0, {{-kInf, 0, 0}, {-65504, 1, 0}}), {}, {}, child_leaves(1, {{65504, 0, 0}, {kInf, 1, 0}})}};
  scene.leaves = {row_leaf(0), row_leaf(1)};
  for (unsigned v = 0; v < 4; ++v) {
    scene.leaves[0].vertex[v][0] = v % 2 == 0 ? -1e6f : -7e4f;
    scene.leaves[1].vertex[v][0] = v % 2 == 0 ? 65510 : 1e30f;
  }
  scene.leaves[0].primitive = {0, 1};
  scene.leaves[1].primitive = {2, 3};
  scene.map = {0, 1, 2, 3};
  scene.geometries = {{0, 4, 0, 0xffffffffu, 0}};
  return scene;
}

/// One geometry whose only triangle is dropped.
inline TestScene empty_scene(NodeLayout layout) {
  TestScene scene;
  scene.layout = layout;
  scene.features = 0;
  scene.map = {0xffffffffu};
  scene.geometries = {{0, 1, 1, 0xffffffffu, 0}};
  return scene;
}

}  // namespace hiprt::test
