/// Colours of render() where light and geometry are known.

#include "scenes_to_render.h"

#include <hiprt_device/math/vec_functions.h>
#include <tools/render/image/color_map.h>
#include <tools/render/studio/heatmap.h>

#include <algorithm>
#include <cmath>

using namespace hiprt;
using namespace hiprt::test;
using namespace hiprt::tools;

namespace {

RenderOptions options_of(RenderMode mode, std::uint32_t samples) {
  return {.mode = mode, .width = 65, .height = 49, .samples = samples, .threads = 2};
}

/// Clay that sees the whole sky.
Vec3 open_clay(const Studio& studio, const Vec3& normal) { return Studio::clay() * studio.open_sky(normal); }

/// The share of the pixel [at, at + 1) that lies between low and high.
double covered(double at, double low, double high) {
  return std::max(0.0, std::min(at + 1.0, high) - std::max(at, low));
}

}  // namespace

TEST_CASE("ao: a plane that nothing shades has the light of the open sky, without noise") {
  const Scene scene = make_scene({oracle::placed(oracle::grid_plane(6, 2, 0), 10)});
  for (const std::uint32_t samples : {1u, 2u, 16u}) {
    const Rendering rendering = render_or_fail(scene, front_camera(), options_of(RenderMode::kAo, samples));
    CHECK(rendering.rays.shadow == 65 * 49 * samples);
    const Vec3 expected = open_clay(Studio(front_camera()), {0, 0, 1});
    float worst = 0.0f;
    for (const Pixel& pixel : rendering.image.pixels)
      worst = std::max(worst, largest_difference(pixel.color, expected));
    CHECK(worst < 1e-5f);
  }
}

TEST_CASE("ao: a convex body never shades itself, wherever it is and whatever its size") {
  for (const auto& [scale, x] : {std::pair{1.0, 0.0}, {1e-6, 0.0}, {1e6, 3e6}, {1.0, 1e4}}) {
    INFO("scale " << scale << " at " << x);
    const Scene scene = make_scene({oracle::placed(oracle::icosphere(3), scale, {x, x, x})});
    const Camera camera{Vec3d(x) + scale * Vec3d(0, 1, 3), Vec3d(x), {0, 1, 0}, 45};
    const Rendering rendering = render_or_fail(scene, camera, options_of(RenderMode::kAo, 1));
    const Studio studio(camera);
    std::size_t hits = 0;
    float worst = 0.0f;
    for (const Pixel& pixel : rendering.image.pixels) {
      if (pixel.primitive == kInvalidId) continue;
      ++hits;
      worst = std::max(worst, largest_difference(pixel.color, open_clay(studio, pixel.normal)));
    }
    CHECK(hits > 700);
    CHECK(worst < 1e-5f);
  }
}

TEST_CASE("ao: no light gets into a closed body") {
  // A convex one: in a sharp crease a ray that starts beside one wall may start beyond the other.
  for (const double offset : {0.0, 1e4}) {
    INFO("offset " << offset);
    const Scene scene = make_scene({oracle::placed(oracle::icosphere(3), 1.0, {offset, offset, offset})});
    const Camera camera{Vec3d(offset), Vec3d(offset, offset, offset - 1), {0, 1, 0}, 120};
    const Rendering rendering = render_or_fail(scene, camera, options_of(RenderMode::kAo, 4));
    CHECK(rendering.rays.shadow == 65 * 49 * 4);
    for (const Pixel& pixel : rendering.image.pixels) {
      REQUIRE(pixel.primitive != kInvalidId);
      REQUIRE(pixel.color == Vec3(0.0f));
    }
  }
}

TEST_CASE("ao: surfaces farther away than the distance given cast no shadow") {
  // A floor below a lid of the same size at a distance of 1, seen from between them.
  Mesh mesh = oracle::grid_plane(4, 1, 0);
  oracle::append(mesh, oracle::grid_plane(4, 1, 1));
  const Scene scene = make_scene({mesh});
  const Camera camera{{0, 0.5, 0.5}, {0, 0, 0}, {0, 1, 0}, 20};
  RenderOptions options = options_of(RenderMode::kAo, 32);
  const Vec3 open = open_clay(Studio(camera), {0, 1, 0});
  const auto brightest_and_darkest = [&] {
    float least = 1.0f, most = 0.0f;
    for (const Pixel& pixel : render_or_fail(scene, camera, options).image.pixels) {
      REQUIRE(pixel.normal == Vec3(0, 1, 0));
      least = std::min(least, luminance(pixel.color) / luminance(open));
      most = std::max(most, luminance(pixel.color) / luminance(open));
    }
    return std::pair(least, most);
  };
  CHECK(brightest_and_darkest().second < 0.75f);
  options.ao_distance = 0.9f;
  CHECK(brightest_and_darkest().first == Approx(1.0).epsilon(1e-5));
  CHECK(brightest_and_darkest().second == Approx(1.0).epsilon(1e-5));
  options.ao_distance = 1.2f;
  CHECK(brightest_and_darkest().first < 0.99f);
}

TEST_CASE("primary and normals: the colour of one sample is that of the layers' normal") {
  const Scene scene = make_scene(star_and_soup());
  const Camera camera = corner_camera();
  const CameraRays rays(camera, 65, 49);
  const Rendering primary = render_or_fail(scene, camera, options_of(RenderMode::kPrimary, 1));
  const Rendering normals = render_or_fail(scene, camera, options_of(RenderMode::kNormals, 1));
  float worst = 0.0f;
  for (std::uint32_t y = 0; y < 49; ++y)
    for (std::uint32_t x = 0; x < 65; ++x) {
      const Pixel &lit = primary.image.at(x, y), &shown = normals.image.at(x, y);
      const bool hit = lit.primitive != kInvalidId;
      const float cosine = -glm::dot(lit.normal, rays.ray(x + 0.5, y + 0.5).direction);
      CHECK((cosine > 0.0f) == hit);
      const Vec3 clay = hit ? Studio::clay() * cosine : Studio::backdrop(1.0f - (static_cast<float>(y) + 0.5f) / 49.0f);
      const Vec3 display = hit ? linear_from_srgb(shown.normal * 0.5f + 0.5f) : Vec3(0.0f);
      worst = std::max({worst, largest_difference(lit.color, clay), largest_difference(shown.color, display)});
    }
  CHECK(worst < 1e-6f);
}

TEST_CASE("heatmap: colours are the layers' tests on the scale of the legend") {
  const Scene scene = make_scene(star_and_soup());
  RenderOptions options = options_of(RenderMode::kHeatmap, 1);
  options.width = 260;
  options.height = 160;
  const Rendering rendering = render_or_fail(scene, corner_camera(), options);
  Image blank(260, 160);
  std::vector<float> cost;
  for (const Pixel& pixel : rendering.image.pixels)
    cost.push_back(static_cast<float>(pixel.box_tests + pixel.leaf_tests));
  const HeatRange range = heat_range(cost);
  CHECK(range.top >= 8);
  const std::vector<std::uint64_t> histogram(kLegendParts, 1);
  const auto area = draw_legend(blank, {"x", 4, false, histogram});
  REQUIRE(area.has_value());
  std::size_t compared = 0;
  float worst = 0.0f;
  for (std::uint32_t y = 0; y < area->top; ++y)
    for (std::uint32_t x = 0; x < 260; ++x, ++compared) {
      const float share = cost[std::size_t{y} * 260 + x] / static_cast<float>(range.top);
      worst = std::max(worst, largest_difference(rendering.image.at(x, y).color, viridis(share)));
    }
  CHECK(compared > 15000);
  CHECK(worst < 1e-6f);
}

TEST_CASE("Pixel sampling: a pixel's colour is the mean over its area") {
  // The square [-1, 1]^2 seen straight on: normals are (0, 0, 1), blue is 1 on it and 0 beside it.
  const Scene scene = make_scene({oracle::grid_plane(3, 2, 0)});
  const CameraRays rays(front_camera(), 65, 49);
  const auto low = rays.project({-1, 1, 0}), high = rays.project({1, -1, 0});
  const Rendering rendering = render_or_fail(scene, front_camera(), options_of(RenderMode::kNormals, 64));
  double sum = 0.0, worst = 0.0;
  std::size_t partial = 0;
  for (std::uint32_t y = 0; y < 49; ++y)
    for (std::uint32_t x = 0; x < 65; ++x) {
      const double expected = covered(x, low.x, high.x) * covered(y, low.y, high.y);
      const double blue = rendering.image.at(x, y).color.z;
      worst = std::max(worst, std::abs(blue - expected));
      sum += blue;
      if (expected > 0.1 && expected < 0.9 && blue > 0.0 && blue < 1.0) ++partial;
    }
  // Stratified: 64 points miss a share of the pixel by one or two of them, not by the eight of random ones.
  CHECK(worst < 2.5 / 64);
  CHECK(sum == Approx((high.x - low.x) * (high.y - low.y)).epsilon(1e-3));
  CHECK(partial > 100);
}

TEST_CASE("Pixel sampling: a seed gives one picture, another seed other noise, one sample none") {
  const Scene scene = make_scene(star_and_soup());
  RenderOptions options = options_of(RenderMode::kAo, 4);
  const Image first = render_or_fail(scene, corner_camera(), options).image;
  CHECK(same_bytes(first, render_or_fail(scene, corner_camera(), options).image));
  options.seed = 1;
  const Image second = render_or_fail(scene, corner_camera(), options).image;
  CHECK_FALSE(same_bytes(first, second));
  Vec3 difference(0.0f);
  for (std::size_t i = 0; i < first.pixels.size(); ++i)
    difference += (first.pixels[i].color - second.pixels[i].color) / static_cast<float>(first.pixels.size());
  CHECK(largest_difference(difference, Vec3(0.0f)) < 0.01f);
  // One sample goes through the centre whatever the seed; modes without shadow rays have no noise then.
  for (const RenderMode mode : {RenderMode::kPrimary, RenderMode::kNormals, RenderMode::kHeatmap}) {
    RenderOptions one = options_of(mode, 1), other = one;
    other.seed = 99;
    CHECK(same_bytes(render_or_fail(scene, corner_camera(), one).image,
                     render_or_fail(scene, corner_camera(), other).image));
  }
}
