/// Paths on a GPU: every bit of the sums is the CPU's.

#include <hiprt_build/format/view.h>
#include <tests/render/path_scenes.h>
#include <tests/traversal/customs/shape_scenes.h>
#include <tools/render/path/gpu_path_tracer.h>
#include <tools/render/tracers/gpu_tracer.h>

using namespace hiprt;
using namespace hiprt::test;
using namespace hiprt::tools;

namespace {

Material material(float color, float metallic, float roughness) {
  Material result;
  result.base_color = {color, 0.5f * color, color};
  result.metallic = metallic;
  result.roughness = roughness;
  return result;
}

Material lamp() {
  Material result = material(0.0f, 0.0f, 1.0f);
  result.emission = {8.0f, 6.0f, 4.0f};
  return result;
}

oracle::Mesh raised(oracle::Mesh mesh, float y) {
  for (auto& p : mesh.positions) p[1] += y;
  return mesh;
}

Vec3 sky(const Vec3& d) { return Vec3(0.2f + 0.2f * d.y, 0.3f, 0.4f); }

void compare(const PathTestScene& scene, const PathData& data, const PathOptions& options) {
  const BufferView view = scene.view();
  const Camera camera{{3, 3, 4}, {0, 0.5, 0}, {0, 1, 0}, 50};
  const PathPicture cpu = trace_well(scene, data, camera, options);
  auto tracer = GpuTracer::make(view);
  INFO((tracer ? std::string() : tracer.error().message));
  REQUIRE(tracer.has_value());
  auto paths = GpuPathTracer::make(*tracer, data, settings_of(options, camera));
  INFO((paths ? std::string() : paths.error().message));
  REQUIRE(paths.has_value());
  const auto gpu = trace_paths(make_scene_view(view), data, camera, options, {}, &*paths);
  INFO((gpu ? std::string() : gpu.error().message));
  REQUIRE(gpu.has_value());
  CHECK(gpu->rays.secondary == cpu.rays.secondary);
  CHECK(gpu->rays.shadow == cpu.rays.shadow);
  std::size_t other = 0;
  for (std::size_t i = 0; i < cpu.sums.size(); ++i) other += cpu.sums[i].sum == gpu->sums[i].sum ? 0 : 1;
  CHECK(other == 0);
  CHECK(same_sums(cpu, *gpu));
  CHECK(mean_of(cpu).x > 0.01);
}

}  // namespace

TEST_CASE("a GPU's paths are the CPU's: materials, lamps, a sky") {
  const PathTestScene scene =
      flat_scene({floor_square(3.0f), raised(floor_square(0.5f), 3.0f), raised(oracle::icosphere(2), 1.0f)},
                 {material(0.7f, 0.0f, 1.0f), lamp(), material(0.9f, 1.0f, 0.3f)});
  // Passes of 1, 1, 2, 4 and 3 samples, which lie side by side; the last strip of pixels is not a whole one.
  compare(scene, data_of(scene, sky), {.width = 25, .height = 13, .samples = 11});
}

TEST_CASE("a GPU's paths are the CPU's: alpha cut-outs, textures, instances that move") {
  const build::Motion motion{.keys = {{.time = 0, .translation = {0, 1, 0}},
                                      {.time = 1, .translation = {0.5f, 1.5f, 0}, .rotation = {0, 0.5f, 0.5f, 1}}}};
  build::Instance light{.object = 1};
  light.to_scene.row[1][3] = 3.0f;
  Material cloth = material(0.8f, 0.0f, 0.6f);
  cloth.alpha_cutoff = 0.5f;
  cloth.base_color_texture.texture = 0;
  PathTestScene scene = instanced_scene({floor_square(3.0f), floor_square(0.5f), oracle::icosphere(2)},
                                        {material(0.7f, 0.0f, 1.0f), lamp(), cloth},
                                        {{.object = 0}, light, {.object = 2, .motion = &motion}});
  scene.surfaces.textures.push_back({"checks", 2, 2, {0xff4080c0u, 0x00ffffffu, 0x20ffffffu, 0xffc08040u}});
  for (const auto& p : oracle::icosphere(2).positions)
    scene.surfaces.objects[2][0].coordinates.push_back({4 * p[0], 4 * p[1]});
  compare(scene, data_of(scene, sky), {.width = 24, .height = 16, .samples = 3, .shutter = {0.0f, 1.0f}});
}

TEST_CASE("a GPU's paths are the CPU's: spheres of a material behind alpha cut-outs, flat and in instances that move") {
  Material cloth = material(0.8f, 0.0f, 0.6f);
  cloth.alpha_cutoff = 0.5f;
  cloth.base_color_texture.texture = 0;
  PathTestScene scene =
      scene_with_balls({floor_square(3.0f), raised(floor_square(0.5f), 3.0f), raised(floor_square(1.5f), 2.0f)},
                       {{{0, 1, 0}, 0.75f}, {{1, 0.5f, 1}, 0.25f}},
                       {material(0.7f, 0.0f, 1.0f), lamp(), cloth, material(0.9f, 1.0f, 0.3f)});
  scene.surfaces.textures.push_back({"checks", 2, 2, {0xff4080c0u, 0x00ffffffu, 0x20ffffffu, 0xffc08040u}});
  scene.surfaces.objects[0][2].coordinates = {{0, 0}, {4, 0}, {4, 4}, {0, 4}};
  compare(scene, data_of(scene, sky), {.width = 24, .height = 16, .samples = 3});
  const build::Motion motion{.keys = {{.time = 0, .translation = {0, 0, 0}},
                                      {.time = 1, .translation = {0.5f, 0.25f, 0}, .rotation = {0, 0.5f, 0.5f, 1}}}};
  scene = in_instances(std::move(scene), {{.object = 0}, {.object = 0, .id = 1, .motion = &motion}});
  compare(scene, data_of(scene, sky), {.width = 24, .height = 16, .samples = 3, .shutter = {0.0f, 1.0f}});
}

TEST_CASE("a GPU's paths are the CPU's: triangles that move, with textures and normals of each time") {
  oracle::Mesh ball = raised(oracle::icosphere(2), 1.0f), flat = ball;
  for (auto& p : flat.positions) p[1] = 0.5f + 0.5f * p[1];
  KeyedMesh moving{{0, 0.25f, 1}, {ball, flat, raised(flat, 0.5f)}};
  const oracle::Mesh sphere = oracle::icosphere(2);
  for (int k = 0; k < 3; ++k)
    for (const auto& p : sphere.positions) moving.normals.push_back({p[0], p[1], k == 0 ? p[2] : -p[2]});
  Material cloth = material(0.8f, 0.0f, 0.6f);
  cloth.alpha_cutoff = 0.5f;
  cloth.base_color_texture.texture = 0;
  PathTestScene scene = scene_with_motion({floor_square(3.0f), raised(floor_square(0.5f), 3.0f)}, moving,
                                          {material(0.7f, 0.0f, 1.0f), lamp(), cloth});
  scene.surfaces.textures.push_back({"checks", 2, 2, {0xff4080c0u, 0x00ffffffu, 0x20ffffffu, 0xffc08040u}});
  for (const auto& p : oracle::icosphere(2).positions)
    scene.surfaces.objects[0][2].coordinates.push_back({4 * p[0], 4 * p[1]});
  compare(scene, data_of(scene, sky), {.width = 24, .height = 16, .samples = 3, .shutter = {0.0f, 1.0f}});
}

TEST_CASE("a GPU's paths are the CPU's: spheres and curves of clay, in instances that move") {
  PathTestScene scene;
  scene.file = std::move(checks::ShapeScene(2, 20261123).file);
  auto data = make_path_data(scene.view(), nullptr, make_sky(sky, 32), {}, 0.5f);
  REQUIRE(data.has_value());
  compare(scene, *data, {.width = 24, .height = 16, .samples = 3, .shutter = {0.0f, 1.0f}});
}
