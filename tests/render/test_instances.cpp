/// The picture of a scene of instances equals the picture of the same triangles in one flat scene.

#include "scenes_to_render.h"

#include <tests/traversal/instances/instance_scenes.h>
#include <tools/render/studio/heatmap.h>

#include <cmath>

using namespace hiprt;
using namespace hiprt::test;
using namespace hiprt::tools;
using checks::affine;
using checks::InstanceScene;

namespace {

/// A picture in which a third of the pixels are near an edge of some kind. The vertices of the flat scene are rounded,
/// and so are the transforms of the other scene. So rays through edges, and their shadow rays, may hit something else:
/// less than 1 in 200.
constexpr RenderOptions kPicture{.width = 160, .height = 120, .samples = 1, .threads = 2};
constexpr std::size_t kMayDiffer = 160 * 120 / 200;

/// Where a point goes, in double.
oracle::Double3 moved(const build::Affine& by, const oracle::Double3& p) {
  oracle::Double3 result{};
  for (unsigned k = 0; k < 3; ++k) {
    const float(&row)[4] = by.row[k];
    result[k] = double{row[0]} * p[0] + double{row[1]} * p[1] + double{row[2]} * p[2] + double{row[3]};
  }
  return result;
}

struct FlatScene {
  std::vector<Mesh> meshes;
  std::vector<std::uint32_t> instance, geometry;  ///< Of each mesh, as the other scene numbers them.
};

/// Objects as InstanceScene has them, and their meshes.
struct Source {
  std::vector<std::vector<Mesh>> objects;
  InstanceScene scene;

  void add(const std::vector<Mesh>& meshes, NodeLayout layout) {
    objects.push_back(meshes);
    scene.add_file(meshes, layout);
  }

  /// @param path the enclosing instances, the innermost first.
  void flatten(std::size_t group, std::vector<const build::Instance*>& path, std::uint32_t outermost,
               FlatScene& flat) const {
    for (std::uint32_t i = 0; i < scene.groups[group].size(); ++i) {
      const build::Instance& instance = scene.groups[group][i];
      const std::uint32_t first = path.empty() ? i : outermost;
      path.insert(path.begin(), &instance);
      if (instance.object >= objects.size())
        flatten(instance.object - objects.size(), path, first, flat);
      else
        append_flat(objects[instance.object], path, first, flat);
      path.erase(path.begin());
    }
  }
  static void append_flat(const std::vector<Mesh>& meshes, const std::vector<const build::Instance*>& path,
                          std::uint32_t outermost, FlatScene& flat) {
    for (std::size_t g = 0; g < meshes.size(); ++g) {
      Mesh mesh = meshes[g];
      for (oracle::Position& position : mesh.positions) {
        oracle::Double3 p{position[0], position[1], position[2]};
        for (const build::Instance* instance : path) p = moved(instance->to_scene, p);
        position = oracle::rounded(p);
      }
      flat.meshes.push_back(std::move(mesh));
      flat.instance.push_back(outermost);
      flat.geometry.push_back(static_cast<std::uint32_t>(g));
    }
  }
  FlatScene flat() const {
    FlatScene flat;
    std::vector<const build::Instance*> path;
    flatten(scene.groups.size() - 1, path, 0, flat);
    return flat;
  }
};

/// A ball, and a torus around a star, in groups of three, each turned, scaled and mirrored; @p levels deep.
Source make_source(unsigned levels, NodeLayout layout) {
  Source source;
  source.add({oracle::icosphere(2)}, layout);
  source.add({oracle::torus(16, 12, 0.3), oracle::placed(oracle::star(1, 5), 0.4)}, layout);
  for (unsigned level = 0; level < levels; ++level) {
    const std::uint32_t last = level + 1;  // The group before; on the first level the torus.
    source.scene.groups.push_back(
        {{.object = last, .to_scene = affine({0.6, 0, 0.8}, 0.7, {0.8, 0.7, 0.9}, {-0.9, 0.2, 0}), .id = 7},
         {.object = last, .to_scene = affine({0, 1, 0}, 2.0, {-0.7, 0.7, 0.7}, {0.8, -0.1, 0.4}), .id = 8},
         {.object = 0, .to_scene = affine({1, 0, 0}, 0.3, {0.3, 0.5, 0.3}, {0, 0.9, 0.1}), .id = 9}});
  }
  source.scene.build();
  return source;
}

Camera camera() { return {{1.2, 1.8, 4.4}, {0, 0.2, 0}, {0.1, 1, 0}, 40}; }

Image draw(const SceneView& scene, RenderMode mode, std::uint32_t samples = 1) {
  RenderOptions options = kPicture;
  options.mode = mode;
  options.samples = samples;
  auto rendering = tools::render(scene, camera(), options);
  if (!rendering) FAIL(rendering.error().message);
  return std::move(rendering->image);
}

bool same_surface(const Pixel& a, const Pixel& b, const FlatScene& flat) {
  if (b.primitive == kInvalidId) return a.primitive == kInvalidId && a.instance == kInvalidId;
  return a.primitive == b.primitive && a.geometry == flat.geometry[b.geometry] &&
         a.instance == flat.instance[b.geometry] && std::abs(a.depth - b.depth) < 1e-5f * b.depth &&
         largest_difference(a.normal, b.normal) < 1e-3f && largest_difference(a.position, b.position) < 1e-4f;
}

}  // namespace

TEST_CASE("render: the layers of a scene of instances equal the flat scene's, on one level and on three") {
  for (const unsigned levels : {1u, 3u})
    for (const NodeLayout layout : {NodeLayout::kPlanes, NodeLayout::kQuantized}) {
      INFO(levels << " levels, layout " << static_cast<unsigned>(layout));
      const Source source = make_source(levels, layout);
      const FlatScene flat = source.flat();
      const Image image = draw(source.scene.view(), RenderMode::kPrimary);
      const Image expected = draw(make_scene(flat.meshes).traced, RenderMode::kPrimary);
      CHECK(image.has_instances);
      CHECK_FALSE(expected.has_instances);
      std::size_t different = 0, hits = 0, instances = 0;
      for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        different += same_surface(image.pixels[i], expected.pixels[i], flat) ? 0 : 1;
        hits += expected.pixels[i].primitive != kInvalidId ? 1 : 0;
        instances += image.pixels[i].instance_tests;
        if (image.pixels[i].primitive != kInvalidId) CHECK(image.pixels[i].instance_tests >= levels);
      }
      CHECK(hits > 3000);
      CHECK(instances > hits);
      CHECK(different <= kMayDiffer);
    }
}

TEST_CASE("render: every mode draws a scene of instances as it does the flat scene") {
  for (const unsigned levels : {1u, 3u})
    for (const RenderMode mode : {RenderMode::kAo, RenderMode::kPrimary, RenderMode::kNormals}) {
      INFO(levels << " levels, mode " << static_cast<int>(mode));
      const Source source = make_source(levels, NodeLayout::kPlanes);
      const Image image = draw(source.scene.view(), mode, 2);
      const Image expected = draw(make_scene(source.flat().meshes).traced, mode, 2);
      std::size_t different = 0;
      for (std::size_t i = 0; i < image.pixels.size(); ++i)
        different += largest_difference(image.pixels[i].color, expected.pixels[i].color) < 2e-3f ? 0 : 1;
      CHECK(different <= kMayDiffer);
    }
}

TEST_CASE("render: the heat map of a scene of instances counts tests and instances") {
  const Source source = make_source(2, NodeLayout::kPlanes);
  const Image image = draw(source.scene.view(), RenderMode::kHeatmap),
              layers = draw(source.scene.view(), RenderMode::kAo);
  std::vector<float> cost;
  for (const Pixel& pixel : layers.pixels)
    cost.push_back(static_cast<float>(pixel.box_tests + pixel.leaf_tests + pixel.instance_tests));
  Image expected(kPicture.width, kPicture.height);
  expected.has_instances = true;
  apply_heatmap(expected, cost);
  bool equal = true;
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    equal = equal && image.pixels[i].color == expected.pixels[i].color;
  CHECK(equal);
}
