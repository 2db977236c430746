/// render(): the layers agree with the exact oracle and closest_hit(). Only scene, camera and options influence the
/// picture.

#include "scenes_to_render.h"

#include <hiprt_device/math/vec_functions.h>
#include <hiprt_device/query/query.h>
#include <tests/oracle/brute_force.h>
#include <tools/base/interrupt.h>

#include <cmath>
#include <csignal>

using namespace hiprt;
using namespace hiprt::test;
using namespace hiprt::tools;

namespace {

/// Neither side is a multiple of a tile's.
constexpr RenderOptions kSmall{.width = 75, .height = 41, .samples = 1, .threads = 2};

/// The normal of the mesh's triangle by its corners in double, unit, on the side of the ray.
Vec3d normal_of(const Mesh& mesh, std::uint32_t primitive, const Ray& ray) {
  const auto corner = [&](std::size_t i) {
    const oracle::Position& p = mesh.positions[mesh.triangles[primitive][i]];
    return Vec3d(p[0], p[1], p[2]);
  };
  const Vec3d normal = unit(glm::cross(corner(1) - corner(0), corner(2) - corner(0)));
  return glm::dot(normal, Vec3d(ray.direction)) > 0 ? -normal : normal;
}

void check_miss(const Pixel& pixel) {
  CHECK(pixel.geometry == kInvalidId);
  CHECK(pixel.primitive == kInvalidId);
  CHECK(std::isinf(pixel.depth));
  CHECK(pixel.normal == Vec3(0.0f));
  CHECK(pixel.position == Vec3(0.0f));
}

/// Calls check(x, y, ray, pixel) for every pixel with the ray through its centre.
template <class Check> void for_each_pixel(const Image& image, const Camera& camera, const Check& check) {
  const CameraRays rays(camera, image.width, image.height);
  for (std::uint32_t y = 0; y < image.height; ++y)
    for (std::uint32_t x = 0; x < image.width; ++x) {
      INFO("pixel " << x << ", " << y);
      check(x, y, rays.ray(x + 0.5, y + 0.5), image.at(x, y));
    }
}

}  // namespace

TEST_CASE("render: depth, ids, position and normal are those of the exact closest hit") {
  const std::vector<Mesh> meshes = star_and_soup();
  const Rendering rendering = render_or_fail(make_scene(meshes), corner_camera(), kSmall);
  CHECK(rendering.rays.primary == 75 * 41);
  std::array<std::size_t, 2> hits{};
  std::size_t misses = 0;
  for_each_pixel(rendering.image, corner_camera(), [&](auto, auto, const Ray& ray, const Pixel& pixel) {
    const oracle::ExactClosest exact = oracle::closest(meshes, ray);
    REQUIRE(pixel.geometry == exact.geometry);
    REQUIRE(pixel.primitive == exact.primitive);
    if (!exact.found) {
      ++misses;
      return check_miss(pixel);
    }
    ++hits[exact.geometry];
    CHECK(pixel.depth == Approx(exact.where.t).epsilon(1e-6));
    const Vec3d point = Vec3d(ray.origin) + Vec3d(ray.direction) * exact.where.t;
    CHECK(glm::length(Vec3d(pixel.position) - point) < 4e-6);
    CHECK(glm::length(Vec3d(pixel.normal) - normal_of(meshes[exact.geometry], exact.primitive, ray)) < 1e-6);
    CHECK(pixel.box_tests > 0);
    CHECK(pixel.leaf_tests > 0);
    CHECK((pixel.triangle_tests >= pixel.leaf_tests && pixel.triangle_tests <= 2 * pixel.leaf_tests));
  });
  CHECK(hits[0] > 200);
  CHECK(hits[1] > 200);
  CHECK(misses > 200);
}

TEST_CASE("render: layers are closest_hit() of the ray through the pixel's centre, in every mode") {
  const Scene scene = make_scene(star_and_soup());
  for (const RenderMode mode : kAllModes)
    for (const std::uint32_t samples : {1u, 3u}) {
      INFO("mode " << static_cast<int>(mode) << " samples " << samples);
      RenderOptions options = kSmall;
      options.mode = mode;
      options.samples = samples;
      const Rendering rendering = render_or_fail(scene, corner_camera(), options);
      CHECK(rendering.rays.primary == 75 * 41 * (samples == 1 ? 1 : samples + 1));
      CHECK((rendering.rays.shadow > 0) == (mode == RenderMode::kAo));
      CHECK(rendering.seconds > 0);
      bool equal = true;
      for_each_pixel(rendering.image, corner_camera(), [&](auto, auto, const Ray& ray, const Pixel& pixel) {
        const Hit hit = closest_hit(scene.traced, ray);
        equal = equal && pixel.depth == hit.t && pixel.geometry == hit.geometry && pixel.primitive == hit.primitive &&
                (!hit.found() || pixel.position == ray.origin + ray.direction * hit.t);
      });
      CHECK(equal);
    }
}

TEST_CASE("render: the picture does not depend on the number of threads, bit for bit") {
  const Scene scene = make_scene(star_and_soup());
  for (const RenderMode mode : kAllModes) {
    INFO("mode " << static_cast<int>(mode));
    RenderOptions options = kSmall;
    options.mode = mode;
    options.samples = 3;
    options.threads = 1;
    const Rendering one = render_or_fail(scene, corner_camera(), options);
    for (const unsigned threads : {1u, 2u, 5u, 0u}) {
      INFO("threads " << threads);
      options.threads = threads;
      const Rendering other = render_or_fail(scene, corner_camera(), options);
      CHECK(same_bytes(one.image, other.image));
      CHECK(one.rays.primary == other.rays.primary);
      CHECK(one.rays.shadow == other.rays.shadow);
    }
  }
}

TEST_CASE("render: the picture does not depend on the tree") {
  RenderOptions options = kSmall;
  options.samples = 4;
  Image first(1, 1);
  for (Scene& scene : checks::all_scenes(star_and_soup())) {
    INFO(scene.name);
    Image image = render_or_fail(scene, corner_camera(), options).image;
    // The work is the tree's own.
    for (Pixel& pixel : image.pixels) {
      pixel.box_tests = pixel.leaf_tests = pixel.triangle_tests = pixel.steps = 0;
      pixel.leaf_fill = 0;
    }
    if (first.pixels.size() == 1) first = image;
    CHECK(same_bytes(first, image));
  }
}

TEST_CASE("render: without layers the colours are the same, and fewer rays are traced") {
  const Scene scene = make_scene(star_and_soup());
  for (const RenderMode mode : kAllModes) {
    INFO("mode " << static_cast<int>(mode));
    RenderOptions options = kSmall;
    options.mode = mode;
    options.samples = 2;
    const Rendering full = render_or_fail(scene, corner_camera(), options);
    options.layers = false;
    const Rendering plain = render_or_fail(scene, corner_camera(), options);
    CHECK(full.rays.primary - plain.rays.primary == 75 * 41);
    CHECK(full.rays.shadow == plain.rays.shadow);
    bool equal = true;
    for (std::size_t i = 0; i < full.image.pixels.size(); ++i)
      equal = equal && full.image.pixels[i].color == plain.image.pixels[i].color;
    CHECK(equal);
    for (const Pixel& pixel : plain.image.pixels) check_miss(pixel);
  }
}

TEST_CASE("render: an empty scene gives a backdrop in every mode") {
  const Scene scene = make_scene({});
  for (const RenderMode mode : kAllModes) {
    INFO("mode " << static_cast<int>(mode));
    RenderOptions options = kSmall;
    options.mode = mode;
    const Rendering rendering = render_or_fail(scene, automatic_camera(scene.traced.bounds, 1.5), options);
    CHECK(rendering.rays.shadow == 0);
    for (const Pixel& pixel : rendering.image.pixels) {
      check_miss(pixel);
      CHECK((pixel.box_tests == 0 && pixel.leaf_tests == 0 && pixel.triangle_tests == 0));
    }
    if (mode == RenderMode::kAo || mode == RenderMode::kPrimary)
      for (std::uint32_t y = 0; y < 41; ++y)
        CHECK(rendering.image.at(7, y).color ==
              Studio::backdrop(1.0f - (static_cast<float>(y) + 0.5f) / static_cast<float>(options.height)));
    if (mode == RenderMode::kNormals) CHECK(rendering.image.at(7, 7).color == Vec3(0.0f));
  }
}

TEST_CASE("render: a picture of one pixel, one column and one row") {
  const Scene scene = make_scene({oracle::icosphere(2)});
  for (const auto& [width, height] : {std::pair{1u, 1u}, {1u, 99u}, {99u, 1u}, {32u, 32u}, {33u, 64u}}) {
    INFO(width << " x " << height);
    RenderOptions options = kSmall;
    options.width = width;
    options.height = height;
    const Rendering rendering = render_or_fail(scene, front_camera(), options);
    REQUIRE(rendering.image.pixels.size() == std::size_t{width} * height);
    CHECK(rendering.image.at(width / 2, height / 2).depth == Approx(3.0).epsilon(0.02));
  }
}

TEST_CASE("render: progress grows with every tile, from no two threads at a time, and ends at 1") {
  const Scene scene = make_scene({oracle::icosphere(2)});
  RenderOptions options = kSmall;
  options.threads = 4;
  std::vector<double> reported;  // Unprotected: the thread sanitizer sees whether calls overlap.
  REQUIRE(render(scene.traced, front_camera(), options, [&](double done) { reported.push_back(done); }));
  const std::vector<double> expected{1 / 6.0, 2 / 6.0, 3 / 6.0, 4 / 6.0, 5 / 6.0, 1.0};
  CHECK(reported == expected);
}

TEST_CASE("render: a signal ends the rendering early with an error") {
  const Scene scene = make_scene({oracle::icosphere(2)});
  RenderOptions options = kSmall;
  options.width = options.height = 320;  // A hundred tiles.
  for (const int signal : {SIGINT, SIGTERM}) {
    const InterruptGuard guard;
    std::size_t tiles = 0;
    const auto rendering = render(scene.traced, front_camera(), options, [&](double) {
      if (++tiles == 3) std::raise(signal);
    });
    REQUIRE_FALSE(rendering.has_value());
    CHECK(rendering.error().code == build::ErrorCode::kCancelled);
    CHECK(tiles >= 3);
    CHECK(tiles < 20);
  }
  const InterruptGuard guard;  // A new one starts anew.
  CHECK(render(scene.traced, front_camera(), options).has_value());
}

TEST_CASE("render: a scene with features that the tracer was not compiled for is refused") {
  Scene scene = make_scene({oracle::icosphere(1)});
  scene.traced.features |= FeatureMask{1} << 40;
  const auto rendering = render(scene.traced, front_camera(), kSmall);
  REQUIRE_FALSE(rendering.has_value());
  CHECK(rendering.error().code == build::ErrorCode::kInvalidInput);
  CHECK_THAT(rendering.error().message, Catch::Contains("features"));
}
