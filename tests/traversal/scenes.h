#pragma once
/// Built scenes for traversal tests: one mesh list under every builder, layout, leaf size and pairing.

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/format/quantize.h>
#include <hiprt_device/scene_view.h>
#include <tests/oracle/brute_force.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/mesh.h>
#include <tools/cli/build/build_names.h>

#include <tests/catch.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace hiprt::checks {

using namespace hiprt::oracle;

/// A BVH file in memory and the views of it.
struct Scene {
  std::string name;
  build::Bvh bvh;
  BufferView view;
  SceneView traced;
};

/// Trees of every kind: split from the top or joined from the leaves, of good and of bad quality, with split
/// references. (tools::kBuilders has all builders.)
inline constexpr std::array<build::Builder, 4> typical_builders() {
  return {build::Builder::kSah, build::Builder::kLbvh, build::Builder::kHploc, oracle::kEmbreeHigh};
}

/// Whether quantized nodes can hold all triangles that are not dropped.
inline bool fits_quantized(const std::vector<Mesh>& meshes) {
  const auto fits = [](const Position& p) {
    return std::all_of(p.begin(), p.end(), [](float x) { return std::abs(x) <= kQuantizedLimit; });
  };
  for (const Mesh& mesh : meshes)
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const Corners c = corners(mesh, i);
      const bool dropped = !is_finite(c) || c.p0 == c.p1 || c.p1 == c.p2 || c.p2 == c.p0;
      if (!dropped && !(fits(c.p0) && fits(c.p1) && fits(c.p2))) return false;
    }
  return true;
}

inline Scene make_scene(const std::vector<Mesh>& meshes, const build::BuildOptions& options = {}) {
  const auto views = oracle::views(meshes);
  auto bvh = build::build(views, options);
  INFO((bvh ? "" : bvh.error().message));
  REQUIRE(bvh.has_value());
  Scene scene;
  scene.name = std::string(build::name(options.builder)) + " " + tools::word_of(tools::kLayouts, options.nodes) +
               " leaf " + std::to_string(options.max_leaf_triangles) + (options.pair_triangles ? "" : " unpaired");
  scene.bvh = std::move(*bvh);
  const auto view = open_buffer(std::as_const(scene.bvh.buffer).bytes());
  REQUIRE(view.has_value());
  scene.view = *view;
  scene.traced = scene.bvh.scene();
  return scene;
}

/// Every builder in the default layout, and typical builders with float nodes. Both layouts also with leaves of up to
/// 1, 2, 4 and 8 triangles, paired and not. The half and quantized layouts round boxes by the same code for all
/// builders: two builders are enough for them.
inline std::vector<Scene> all_scenes(const std::vector<Mesh>& meshes) {
  std::vector<Scene> scenes;
  for (const auto& [word, builder] : tools::kBuilders) scenes.push_back(make_scene(meshes, {.builder = builder}));
  for (const build::Builder builder : typical_builders())
    scenes.push_back(make_scene(meshes, {.builder = builder, .nodes = NodeLayout::kFloat}));
  for (const NodeLayout layout : {NodeLayout::kPlanes, NodeLayout::kFloat}) {
    for (const unsigned leaf : {1u, 2u, 4u, 8u})
      for (const bool pair : {true, false})
        scenes.push_back(make_scene(meshes, {.nodes = layout, .max_leaf_triangles = leaf, .pair_triangles = pair}));
  }
  for (const NodeLayout layout : {NodeLayout::kHalf, NodeLayout::kQuantized}) {
    if (layout == NodeLayout::kQuantized && !fits_quantized(meshes)) continue;
    for (const build::Builder builder : {build::Builder::kSah, oracle::kEmbreeHigh})
      scenes.push_back(make_scene(meshes, {.builder = builder, .nodes = layout}));
  }
  return scenes;
}

}  // namespace hiprt::checks
