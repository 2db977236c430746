/// Path-traced pictures against light that other methods compute, and against each other.

#include "path_scenes.h"

#include <hiprt_build/format/view.h>
#include <tests/oracle/random.h>
#include <tools/base/interrupt.h>
#include <tools/render/path/path_bsdf.h>

#include <algorithm>
#include <csignal>

using namespace hiprt;
using namespace hiprt::test;
using namespace hiprt::tools;

namespace {

Material clay(float value) {
  Material material;
  material.base_color = {value, value, value};
  material.metallic = 0.0f;
  return material;
}

Material lamp(float value) {
  Material material = clay(0.0f);
  material.emission = {value, 0.5f * value, 0.25f * value};
  return material;
}

oracle::Mesh moved(oracle::Mesh mesh, float x, float y, float z) {
  for (auto& p : mesh.positions) p = {p[0] + x, p[1] + y, p[2] + z};
  return mesh;
}

/// From above at a part of the floor so small that it is one point.
const Camera kDown{{0.1, 3, 0}, {0.1, 0, 0}, {0, 0, 1}, 0.02};
constexpr PathOptions kPoint{.width = 16, .height = 16, .samples = 64};

/// What a square of half side @p half at height @p height sends to the camera by the floor's point below: the
/// integral over the lamp in double.
double by_sum(const Material& floor, float half, float height, double radiance) {
  PathSurface surface;
  surface.base_color = Vec3(floor.base_color[0]);
  surface.metallic = floor.metallic;
  surface.roughness = floor.roughness;
  const Bsdf bsdf(surface, Vec3(0, 0, 1));
  constexpr int kSteps = 400;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i)
    for (int k = 0; k < kSteps; ++k) {
      const double x = half * (2.0 * (i + 0.5) / kSteps - 1.0) - 0.1, y = half * (2.0 * (k + 0.5) / kSteps - 1.0);
      const double squared = x * x + y * y + static_cast<double>(height) * height, distance = std::sqrt(squared);
      const Vec3 wi(static_cast<float>(x / distance), static_cast<float>(y / distance),
                    static_cast<float>(height / distance));
      sum += static_cast<double>(bsdf.value(wi).x) * (height / distance) / squared;
    }
  return sum * radiance * 4.0 * half * half / (kSteps * kSteps);
}

}  // namespace

TEST_CASE("a lamp above a floor: the light equals a sum over the lamp, for rough and smooth floors") {
  // The camera looks through a hole: the lamp is a frame of four squares around its line of sight, or is beside it.
  for (const float roughness : {1.0f, 0.4f}) {
    Material floor = clay(0.5f);
    floor.roughness = roughness;
    const std::vector<oracle::Mesh> meshes{floor_square(4.0f), moved(floor_square(0.5f), 0.0f, 4.0f, 0.0f)};
    const PathTestScene scene = flat_scene(meshes, {floor, lamp(10.0f)});
    const PathData data = data_of(scene, black);
    PathOptions options = kPoint;
    options.bounces = 1;
    const double found = mean_of(trace_well(scene, data, kDown, options)).x;
    const double expected = by_sum(floor, 0.5f, 4.0f, 10.0);
    CAPTURE(roughness);
    CHECK(found == Approx(expected).epsilon(0.01));
  }
}

TEST_CASE("bounces: 0 shows lamps only, 1 direct light, and more bounces never less light") {
  const std::vector<oracle::Mesh> meshes{floor_square(4.0f), moved(floor_square(0.5f), 0.0f, 4.0f, 0.0f),
                                         moved(floor_square(4.0f), 0.0f, 5.0f, 0.0f)};
  const PathTestScene scene = flat_scene(meshes, {clay(0.8f), lamp(10.0f), clay(0.8f)});
  const PathData data = data_of(scene, black);
  double before = -1.0;
  for (const std::uint32_t bounces : {0u, 1u, 2u, 4u}) {
    PathOptions options = kPoint;
    options.bounces = bounces;
    const double found = mean_of(trace_well(scene, data, kDown, options)).x;
    CHECK(found > before);
    if (bounces == 0) {
      CHECK(found == 0.0);
    }
    before = found;
  }
  // Straight up from the floor's level at the lamp.
  const Camera up{{0, 1, 0}, {0, 4, 0}, {0, 0, 1}, 1.0};
  PathOptions options = kPoint;
  options.bounces = 0;
  CHECK(mean_of(trace_well(scene, data, up, options)).x == Approx(10.0));
  CHECK(mean_of(trace_well(scene, data, up, options)).y == Approx(5.0));
}

TEST_CASE("an even sky lights a floor by its reflectance") {
  const PathTestScene scene = flat_scene({floor_square(4.0f)}, {clay(0.5f)});
  const PathData data = data_of(scene, [](const Vec3&) { return Vec3(1.0f); });
  PathSurface surface;
  surface.base_color = Vec3(0.5f);
  const Bsdf bsdf(surface, Vec3(0, 0, 1));
  double expected = 0.0;
  constexpr int kRings = 2000;
  for (int i = 0; i < kRings; ++i) {
    const double z = (i + 0.5) / kRings;
    expected +=
        2.0 * 3.14159265358979323846 / kRings *
        static_cast<double>(bsdf.value(Vec3(static_cast<float>(std::sqrt(1 - z * z)), 0, static_cast<float>(z))).x);
  }
  CHECK(mean_of(trace_well(scene, data, kDown, kPoint)).x == Approx(expected).epsilon(0.005));
}

TEST_CASE("lamps in instances give the light of the same lamps without instances") {
  const oracle::Mesh floor = floor_square(4.0f), square = floor_square(0.5f);
  const PathTestScene flat = flat_scene({floor, moved(square, 0.0f, 4.0f, 0.0f), moved(square, 2.0f, 3.0f, 1.0f)},
                                        {clay(0.5f), lamp(10.0f), lamp(10.0f)});
  build::Instance first{.object = 1}, second{.object = 1};
  first.to_scene.row[1][3] = 4.0f;
  second.to_scene.row[0][3] = 2.0f;
  second.to_scene.row[1][3] = 3.0f;
  second.to_scene.row[2][3] = 1.0f;
  const PathTestScene placed =
      instanced_scene({floor, square}, {clay(0.5f), lamp(10.0f)}, {{.object = 0}, first, second});
  const double a = mean_of(trace_well(flat, data_of(flat, black), kDown, kPoint)).x;
  const double b = mean_of(trace_well(placed, data_of(placed, black), kDown, kPoint)).x;
  CHECK(a == Approx(b).epsilon(1e-3));
  CHECK(a > 0.0);
}

TEST_CASE("a moving lamp is at its position at each ray's time") {
  const oracle::Mesh floor = floor_square(4.0f), square = floor_square(0.5f);
  const build::Motion motion{.keys = {{.time = 0, .translation = {0, 4, 0}}, {.time = 1, .translation = {100, 4, 0}}}};
  const PathTestScene scene =
      instanced_scene({floor, square}, {clay(0.5f), lamp(10.0f)}, {{.object = 0}, {.object = 1, .motion = &motion}});
  const PathData data = data_of(scene, black);
  PathOptions still = kPoint;
  still.bounces = 1;
  const double there = mean_of(trace_well(scene, data, kDown, still)).x;
  CHECK(there == Approx(by_sum(clay(0.5f), 0.5f, 4.0f, 10.0)).epsilon(0.01));
  PathOptions late = still;
  late.shutter = {1.0f, 1.0f};
  CHECK(mean_of(trace_well(scene, data, kDown, late)).x < 0.001 * there);
  PathOptions open = still;
  open.shutter = {0.0f, 1.0f};
  const double blurred = mean_of(trace_well(scene, data, kDown, open)).x;
  CHECK(blurred > 0.005 * there);
  CHECK(blurred < 0.1 * there);
}

TEST_CASE("alpha cut-outs of a material let light and camera rays through") {
  const std::vector<oracle::Mesh> meshes{floor_square(4.0f), moved(floor_square(0.5f), 0.0f, 4.0f, 0.0f),
                                         moved(floor_square(2.0f), 0.0f, 2.0f, 0.0f)};
  Material cloth = clay(0.5f);
  const auto light_below = [&](float alpha, float cutoff) {
    cloth.alpha = alpha;
    cloth.alpha_cutoff = cutoff;
    const PathTestScene scene = flat_scene(meshes, {clay(0.5f), lamp(10.0f), cloth});
    PathOptions options = kPoint;
    options.bounces = 1;
    const Camera below{{0.1, 1, 0}, {0.1, 0, 0}, {0, 0, 1}, 0.02};
    return mean_of(trace_well(scene, data_of(scene, black), below, options)).x;
  };
  CHECK(light_below(1.0f, 0.0f) == 0.0);
  CHECK(light_below(0.4f, 0.0f) == 0.0);
  CHECK(light_below(0.6f, 0.5f) == 0.0);
  CHECK(light_below(0.4f, 0.5f) == Approx(by_sum(clay(0.5f), 0.5f, 4.0f, 10.0)).epsilon(0.01));
}

TEST_CASE("spheres have the material of their geometry, and are seen and lit through alpha cut-outs of others") {
  const std::vector<ShapePoint> balls{{{0, 0.6f, 0}, 0.5f}, {{1, 0.3f, 0.2f}, 0.25f}};
  const std::vector<oracle::Mesh> meshes{floor_square(4.0f), moved(floor_square(1.0f), 0.0f, 4.0f, 0.0f)};
  Material red = clay(0.75f);
  red.base_color = {0.75f, 0.25f, 0.125f};
  Material nothing = clay(0.5f);
  nothing.alpha = 0.0f;
  nothing.alpha_cutoff = 0.5f;
  const oracle::Mesh veil = moved(floor_square(4.0f), 0.0f, 2.0f, 0.0f);
  const Camera camera{{0, 3, 2}, {0.3, 0.5, 0}, {0, 1, 0}, 30};
  const PathOptions options{.width = 24, .height = 24, .samples = 8};
  for (const bool instanced : {false, true}) {
    CAPTURE(instanced);
    const auto placed = [&](PathTestScene scene) {
      const std::vector<build::Instance> twice{{}, {.to_scene = {{{1, 0, 0, 9}, {0, 1, 0, 0}, {0, 0, 1, 0}}}, .id = 1}};
      return instanced ? in_instances(std::move(scene), twice) : std::move(scene);
    };
    const PathTestScene bare = placed(scene_with_balls(meshes, balls, {clay(0.5f), lamp(10.0f), red}));
    const PathTestScene veiled =
        placed(scene_with_balls({meshes[0], meshes[1], veil}, balls, {clay(0.5f), lamp(10.0f), nothing, red}));
    const PathData data = data_of(bare, black);
    const PathPicture picture = trace_well(bare, data, camera, options);
    CHECK(same_sums(picture, trace_well(veiled, data_of(veiled, black), camera, options)));
    CHECK(mean_of(picture).x > 0.01);
    Image image(24, 24);
    const BufferView view = bare.view();
    REQUIRE(store_surfaces(make_scene_view(view), data, camera, options, image).has_value());
    const auto reds = std::count_if(image.shading.begin(), image.shading.end(),
                                    [](const ShadingPixel& p) { return p.albedo == Vec3(0.75f, 0.25f, 0.125f); });
    CHECK(reds > 24);
    CHECK(reds < 24 * 24 / 2);
  }
}

TEST_CASE("triangles that move look like those of their time that stand still") {
  const std::vector<oracle::Mesh> meshes{floor_square(4.0f), moved(floor_square(1.0f), 0.0f, 4.0f, 0.0f)};
  const std::vector<Material> materials{clay(0.5f), lamp(10.0f), clay(0.75f)};
  const auto tent = [](float top, float side) {
    oracle::Mesh mesh;
    mesh.positions = {{-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}, {side, top, 0}};
    mesh.triangles = {{0, 4, 1}, {1, 4, 2}, {2, 4, 3}, {3, 4, 0}};
    return mesh;
  };
  const auto up = [](float x) { return std::array<float, 3>{x, std::sqrt(1.0f - x * x), 0.0f}; };
  const auto between = [&](float a, float b) {
    return std::array{0.5f * up(a)[0] + 0.5f * up(b)[0], 0.5f * up(a)[1] + 0.5f * up(b)[1], 0.0f};
  };
  KeyedMesh moving{{1, 2, 4}, {tent(1, 0), tent(2, 0.5f), tent(0.5f, -1)}};
  struct Still {
    float time;
    oracle::Mesh mesh;
    std::array<float, 3> normal;
  };
  const std::vector<Still> stills{{-9, tent(1, 0), up(-0.5f)},
                                  {1, tent(1, 0), up(-0.5f)},
                                  {1.5f, tent(1.5f, 0.25f), between(-0.5f, 0.25f)},
                                  {2, tent(2, 0.5f), up(0.25f)},
                                  {3, tent(1.25f, -0.25f), between(0.25f, 0.75f)},
                                  {4, tent(0.5f, -1), up(0.75f)},
                                  {99, tent(0.5f, -1), up(0.75f)}};
  const Camera camera{{0, 3, 4}, {0, 0.5, 0}, {0, 1, 0}, 50};
  for (const bool smooth : {false, true}) {
    for (const float lean : {-0.5f, 0.25f, 0.75f})
      moving.normals.insert(moving.normals.end(), smooth ? 5 : 0, up(lean));
    const PathTestScene scene = scene_with_motion(meshes, moving, materials);
    const PathData data = data_of(scene, black);
    for (const Still& still : stills) {
      CAPTURE(smooth, still.time);
      PathTestScene flat = flat_scene({meshes[0], meshes[1], still.mesh}, materials);
      if (smooth) flat.surfaces.objects[0][2].normals.assign(5, still.normal);
      const PathData flat_data = data_of(flat, black);
      const PathOptions options{.width = 24, .height = 24, .samples = 8, .shutter = {still.time, still.time}};
      // Rays leave a little farther from triangles that move, as their error bounds are larger.
      const double got = mean_of(trace_well(scene, data, camera, options)).x;
      CHECK(got == Approx(mean_of(trace_well(flat, flat_data, camera, options)).x).epsilon(1e-3));
      Image image(24, 24), expected(24, 24);
      const BufferView view = scene.view(), flat_view = flat.view();
      REQUIRE(store_surfaces(make_scene_view(view), data, camera, options, image).has_value());
      REQUIRE(store_surfaces(make_scene_view(flat_view), flat_data, camera, options, expected).has_value());
      int seen = 0;
      for (std::size_t i = 0; i < image.shading.size(); ++i) {
        REQUIRE(image.shading[i].albedo == expected.shading[i].albedo);
        REQUIRE(glm::distance(image.shading[i].normal, expected.shading[i].normal) < 1e-5f);
        seen += image.shading[i].albedo == Vec3(0.75f) ? 1 : 0;
      }
      CHECK(seen > 20);
    }
  }
}

TEST_CASE("a sphere that emits gives the same light beside a small lamp") {
  const oracle::Mesh far = moved(floor_square(1e-3f), 0.0f, 50.0f, 0.0f);
  const std::vector<oracle::Mesh> lamp_first{far, floor_square(4.0f)}, floor{floor_square(4.0f)};
  const std::vector<ShapePoint> ball{{{0, 2, 0}, 1.0f}};
  const PathTestScene alone = scene_with_balls(floor, ball, {clay(0.5f), lamp(10.0f)});
  const PathTestScene beside = scene_with_balls(lamp_first, ball, {lamp(1.0f), clay(0.5f), lamp(10.0f)});
  const PathOptions options{.width = 16, .height = 16, .samples = 64, .bounces = 1};
  const Camera low{{0.1, 0.5, 0}, {0.1, 0, 0}, {0, 0, 1}, 0.02};
  const double light = mean_of(trace_well(alone, data_of(alone, black), low, options)).x;
  CHECK(light > 0.1);
  CHECK(mean_of(trace_well(beside, data_of(beside, black), low, options)).x == Approx(light).epsilon(0.02));
}

TEST_CASE("the light of lamps that deform is found") {
  const std::vector<oracle::Mesh> floor{floor_square(4.0f)};
  const oracle::Mesh low = moved(floor_square(2.0f), 0.0f, 1.0f, 0.0f),
                     high = moved(floor_square(2.0f), 0.0f, 3.0f, 0.0f);
  const PathTestScene scene = scene_with_motion(floor, {{0, 1}, {low, high}}, {clay(0.5f), lamp(10.0f)});
  PathOptions options{.width = 16, .height = 16, .samples = 256, .bounces = 1, .shutter = {0.5f, 0.5f}};
  const Camera below{{0.1, 0.5, 0}, {0.1, 0, 0}, {0, 0, 1}, 0.02};
  const double light = mean_of(trace_well(scene, data_of(scene, black), below, options)).x;
  CHECK(light == Approx(by_sum(clay(0.5f), 2.0f, 2.0f, 10.0)).epsilon(0.02));
}

TEST_CASE("textures: every other texel of a mask is cut out, and colours are sRGB") {
  PathTestScene scene = flat_scene({floor_square(1.0f)}, {clay(1.0f)});
  GeometrySurface& surface = scene.surfaces.objects[0][0];
  surface.coordinates = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  Texture stripes{"stripes", 4, 1, {0xff808080u, 0x00808080u, 0xff808080u, 0x00808080u}};
  scene.surfaces.textures.push_back(stripes);
  scene.surfaces.materials[0].base_color_texture.texture = 0;
  scene.surfaces.materials[0].alpha_cutoff = 0.5f;
  const PathData data = data_of(scene, [](const Vec3&) { return Vec3(1.0f); });
  Image image(64, 64);
  const PathOptions options{.width = 64, .height = 64, .samples = 1};
  const Camera down{{0, 10, 0}, {0, 0, 0}, {0, 0, 1}, 10};
  const BufferView view = scene.view();
  REQUIRE(store_surfaces(make_scene_view(view), data, down, options, image).has_value());
  int seen = 0;
  for (const ShadingPixel& pixel : image.shading) {
    if (pixel.albedo == Vec3(0.0f)) continue;
    ++seen;
    // 0x80 is 0.2158605 in linear light.
    REQUIRE(pixel.albedo.x == Approx(0.2158605f).epsilon(1e-5));
    REQUIRE(pixel.normal == Vec3(0, 1, 0));
  }
  CHECK(seen == 64 * 64 / 2);
}

TEST_CASE("pictures do not depend on threads, and on the seed only in their noise") {
  const std::vector<oracle::Mesh> meshes{floor_square(4.0f), moved(floor_square(0.5f), 0.0f, 2.0f, 0.0f),
                                         oracle::icosphere(2)};
  Material metal = clay(0.9f);
  metal.metallic = 1.0f;
  metal.roughness = 0.3f;
  const PathTestScene scene = flat_scene(meshes, {clay(0.5f), lamp(5.0f), metal});
  const PathData data = data_of(scene, [](const Vec3& d) { return Vec3(0.3f + 0.2f * d.y); });
  const Camera camera{{3, 3, 3}, {0, 0, 0}, {0, 1, 0}, 45};
  PathOptions options{.width = 70, .height = 45, .samples = 5, .threads = 1};
  const PathPicture one = trace_well(scene, data, camera, options);
  options.threads = 3;
  CHECK(same_sums(one, trace_well(scene, data, camera, options)));
  options.seed = 1;
  const PathPicture other = trace_well(scene, data, camera, options);
  CHECK_FALSE(same_sums(one, other));
  CHECK(mean_of(one).x == Approx(mean_of(other).x).epsilon(0.05));
  CHECK(one.rays.camera == 70u * 45u * 5u);
  CHECK(one.rays.secondary > 0);
  CHECK(one.rays.shadow > 0);
  CHECK(one.samples == 5);
}

TEST_CASE("an interrupted rendering keeps the samples so far") {
  const PathTestScene scene = flat_scene({floor_square(4.0f)}, {clay(0.5f)});
  const PathData data = data_of(scene, [](const Vec3&) { return Vec3(1.0f); });
  const InterruptGuard guard;
  PathProgress progress;
  unsigned looks = 0;
  progress.picture = [&](const PathPicture& picture) {
    ++looks;
    if (picture.samples == 4) std::raise(SIGINT);
  };
  const PathOptions options{.width = 40, .height = 40, .samples = 1000};
  const BufferView view = scene.view();
  const auto picture = trace_paths(make_scene_view(view), data, kDown, options, progress);
  REQUIRE(picture.has_value());
  CHECK(picture->samples == 4);
  CHECK(looks == 3);
}
