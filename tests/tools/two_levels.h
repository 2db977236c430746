#pragma once
/// A small scene of instances, as descriptions have it.

#include <tools/scene_io/scene/scene_description.h>

#include <string>

namespace hiprt::test {

inline build::Affine scaled_and_moved(float sx, float sy, float sz, float x) {
  return {{{sx, 0, 0, x}, {0, sy, 0, 0}, {0, 0, sz, 0}}};
}

inline tools::Mesh one_triangle(const std::string& name, float z) {
  return {name, {{0, 0, z}, {1, 0, z}, {0, 1, z}}, {{0, 1, 2}}, {}, 0};
}

/// Object 0 has mesh a, object 1 meshes b and a; group 2 and, above it, the scene.
inline tools::SceneDescription two_levels() {
  using build::Instance;
  tools::SceneDescription scene;
  scene.path = "s";
  scene.meshes = {one_triangle("a", 1), one_triangle("b", 2)};
  scene.objects = {{"a", {0}}, {"b", {1, 0}}};
  scene.groups = {
      {"groups.low",
       {Instance{.object = 1, .to_scene = scaled_and_moved(2, 2, 2, 10), .mask = 6}, Instance{.object = 0, .mask = 5}}},
      {"groups.top",
       {Instance{.object = 2, .to_scene = scaled_and_moved(1, 1, 1, 100)}, Instance{.object = 0, .mask = 8}}}};
  return scene;
}

}  // namespace hiprt::test
