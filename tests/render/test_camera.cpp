#include <hiprt_device/math/vec_functions.h>
#include <tools/render/scene/camera.h>

#include <tests/catch.h>

#include <cmath>
#include <limits>
#include <random>

using namespace hiprt;
using namespace hiprt::tools;
using Catch::Contains;

namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();

Vec3d corner_of(const Box& box, unsigned i) {
  return {(i & 1u) != 0 ? box.max[0] : box.min[0], (i & 2u) != 0 ? box.max[1] : box.min[1],
          (i & 4u) != 0 ? box.max[2] : box.min[2]};
}

/// What part of the picture's width or height the corners cover, the larger; every corner must be inside.
double check_framing(const Box& box, std::uint32_t width, std::uint32_t height) {
  const Camera camera = automatic_camera(box, static_cast<double>(width) / height);
  const CameraRays rays(camera, width, height);
  double left = 1e30, right = -1e30, top = 1e30, bottom = -1e30;
  bool inside = true;
  for (unsigned i = 0; i < 8; ++i) {
    const auto [x, y, in_front] = rays.project(corner_of(box, i));
    inside = inside && in_front && x > 0 && x < width && y > 0 && y < height;
    left = std::min(left, x), right = std::max(right, x), top = std::min(top, y), bottom = std::max(bottom, y);
  }
  INFO(to_text(camera) << " " << width << "x" << height << " " << left << " " << right << " " << top << " " << bottom);
  CHECK(inside);
  CHECK(camera.eye.y > 0.5 * (double{box.min[1]} + box.max[1]));
  return std::max((right - left) / width, (bottom - top) / height);
}

std::string error_of(std::string_view text) {
  const auto camera = parse_camera(text);
  if (camera) FAIL(text << " was accepted");
  return camera.error();
}

}  // namespace

TEST_CASE("Camera: the automatic camera shows the whole box and little else, in every picture shape") {
  const Box cube{{-1, -1, -1}, {1, 1, 1}}, bunny{{-1, -0.99f, -0.78f}, {1, 0.99f, 0.78f}};
  const Box tower{{0, 0, 0}, {1, 50, 1}}, wall{{0, 0, 0}, {0.1f, 3, 30}};
  for (const Box& box : {cube, bunny, tower, wall})
    for (const auto& [width, height] :
         {std::pair{800u, 600u}, {600u, 800u}, {1920u, 1080u}, {500u, 500u}, {2000u, 50u}, {50u, 2000u}}) {
      const double part = check_framing(box, width, height);
      CHECK(part > 0.88);
      CHECK(part < 0.97);
    }
}

TEST_CASE("Camera: flat, tiny, huge and far-away boxes are completely visible") {
  const Box floor{{-5, 0, -5}, {5, 0, 5}}, facing_x{{2, 0, 0}, {2, 1, 1}}, facing_z{{0, 0, 3}, {1, 1, 3}};
  for (const Box& box : {floor, facing_x, facing_z}) CHECK(check_framing(box, 640, 480) > 0.88);
  // Seen from the side of its face, not along its plane.
  const Vec3d side = automatic_camera(facing_x, 1).eye - automatic_camera(facing_x, 1).at;
  CHECK(std::abs(side.x) > std::abs(side.z));
  for (const float scale : {1e-18f, 1e-6f, 1e6f, 1e15f}) {
    const Box box{{-scale, -scale, -scale}, {scale, scale, scale}};
    CHECK(check_framing(box, 640, 480) > 0.88);
  }
  CHECK(check_framing({{1e6f, 1e6f, 1e6f}, {1e6f + 8, 1e6f + 8, 1e6f + 8}}, 640, 480) > 0.85);
  check_framing({{3, 4, 5}, {3, 4, 5}}, 640, 480);
  check_framing({{0, 0, 0}, {0, 0, 0}}, 640, 480);
}

TEST_CASE("Camera: the automatic camera of empty or non-finite bounds is finite") {
  for (const Box& box : {Box{{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}}, Box{{0, 0, 0}, {1, std::nanf(""), 1}}}) {
    const Camera camera = automatic_camera(box, 1.5);
    CHECK(parse_camera(to_text(camera)).has_value());
  }
}

TEST_CASE("Camera: rays and projection agree, the middle looks at the point, up is up") {
  const Camera camera{{3, 4, 5}, {0, 1, 0}, {0, 2, 0}, 50};
  const CameraRays rays(camera, 640, 480);
  const Ray middle = rays.ray(320, 240);
  CHECK(glm::length(Vec3d(middle.direction) - unit(camera.at - camera.eye)) < 1e-6);
  CHECK(rays.ray(320, 0).direction.y > rays.ray(320, 480).direction.y);
  // The picture's right is the viewer's.
  CHECK(glm::dot(Vec3d(rays.ray(640, 240).direction), glm::cross(camera.at - camera.eye, camera.up)) > 0);
  // The vertical angle.
  const double cosine = glm::dot(Vec3d(rays.ray(320, 0).direction), Vec3d(rays.ray(320, 480).direction));
  CHECK(std::acos(cosine) * 180 / 3.14159265358979 == Approx(50).epsilon(1e-6));
  const unsigned seed = 7;
  INFO("seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> x(0, 640), y(0, 480), t(0.1, 100);
  for (int i = 0; i < 1000; ++i) {
    const double px = x(random), py = y(random);
    const Ray ray = rays.ray(px, py);
    CHECK(std::abs(glm::length(ray.direction) - 1.0f) < 1e-6f);
    const auto position = rays.project(Vec3d(ray.origin) + Vec3d(ray.direction) * t(random));
    CHECK(position.in_front);
    CHECK(std::abs(position.x - px) < 1e-3);
    CHECK(std::abs(position.y - py) < 1e-3);
  }
  CHECK_FALSE(rays.project(camera.eye + (camera.eye - camera.at)).in_front);
}

TEST_CASE("Camera: text is read in every accepted form") {
  for (const std::string_view text : {"1,2,3/4,5,6/0,1,0/40", "eye 1 2 3 / at 4 5 6 / up 0 1 0 / 40 / light 7 8 9\n",
                                      " 1 2 3/4 5 6/0 1 0/fov 40", "1,\t2, 3 /\n4,5,6/0,1e0,0.0/4e1/7,8,9"}) {
    INFO(text);
    const auto camera = parse_camera(text);
    REQUIRE(camera.has_value());
    CHECK(camera->eye == Vec3d(1, 2, 3));
    CHECK(camera->at == Vec3d(4, 5, 6));
    CHECK(camera->up == Vec3d(0, 1, 0));
    CHECK(camera->fov_degrees == 40);
  }
  CHECK_FALSE(parse_light("1,2,3/4,5,6/0,1,0/40").value().has_value());
  CHECK(parse_light("eye 1 2 3 / at 4 5 6 / up 0 1 0 / 40 / light 7 8 9\n").value() == Vec3d(7, 8, 9));
  CHECK_THAT(parse_light("1,2,3/4,5,6/0,1,0/40/1,2").error(), Contains("light: expected 3 numbers"));
  const Camera odd{{0.1, -2e-20, 3e9}, {1.0 / 3, 0, 0}, {0, -1, 0.5}, 12.3456789012345};
  const auto again = parse_camera(to_text(odd));
  REQUIRE(again.has_value());
  CHECK((again->eye == odd.eye && again->at == odd.at && again->up == odd.up && again->fov_degrees == odd.fov_degrees));
}

TEST_CASE("Camera: invalid text is refused with the position") {
  CHECK_THAT(error_of(""), Contains("four parts") && Contains("got 1"));
  CHECK_THAT(error_of("1,2,3/4,5,6/0,1,0"), Contains("got 3"));
  CHECK_THAT(error_of("1,2,3/4,5,6/0,1,0/40/1,2,3/5"), Contains("got 6"));
  CHECK_THAT(error_of("1,2/4,5,6/0,1,0/40"), Contains("eye: expected 3 numbers, got 2 in '1,2'"));
  CHECK_THAT(error_of("1,2,3/4,5,6,7/0,1,0/40"), Contains("at: expected 3 numbers, got 4"));
  CHECK_THAT(error_of("1,2,3/4,5,6/0,one,0/40"), Contains("up: 'one' is not a number"));
  CHECK_THAT(error_of("1,2,3/4,5,6/0,1,0/40,41"), Contains("fov: expected 1 number, got 2"));
  CHECK_THAT(error_of("1,2,3/4,5,6/0,1,0/40/1,2"), Contains("light: expected 3 numbers"));
  CHECK_THAT(error_of("at 1,2,3/4,5,6/0,1,0/40"), Contains("eye: 'at' is not a number"));
  CHECK_THAT(error_of("1,2,nan/4,5,6/0,1,0/40"), Contains("eye: 'nan' is not finite"));
  CHECK_THAT(error_of("1,2,1e999/4,5,6/0,1,0/40"), Contains("eye: '1e999'"));
  CHECK_THAT(error_of("1e39,0,0/0,0,0/0,1,0/40"), Contains("eye: beyond"));
  CHECK_THAT(error_of("1,2,3/4,5,6/0,1,0/0"), Contains("fov: ") && Contains("between 0 and 180"));
  CHECK_THAT(error_of("1,2,3/4,5,6/0,1,0/180"), Contains("fov: "));
  CHECK_THAT(error_of("1,2,3/1,2,3/0,1,0/40"), Contains("at: the same point as eye"));
  CHECK_THAT(error_of("1,2,3/4,5,6/0,0,0/40"), Contains("up: must not be zero"));
  CHECK_THAT(error_of("1,2,3/1,5,3/0,1,0/40"), Contains("up: parallel"));
}
