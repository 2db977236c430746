/// bvhquery --slice: the distances of the picture's layers, where its pixels are, and its colours.

#include "query_runs.h"

#include <tests/catch.h>
#include <tests/render/read_images.h>
#include <tools/query/slice.h>

#include <cmath>

using namespace hiprt;
using namespace hiprt::test;

namespace {

/// The box [-2, 2] x [-1, 1] x [-1, 1], closed.
const char* const kBox =
    "v -2 -1 -1\nv 2 -1 -1\nv 2 1 -1\nv -2 1 -1\nv -2 -1 1\nv 2 -1 1\nv 2 1 1\nv -2 1 1\n"
    "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// The distance from the box, negative inside.
double from_box(const double (&p)[3]) {
  const double half[3] = {2, 1, 1};
  double outside = 0, inside = -HUGE_VAL;
  for (int k = 0; k < 3; ++k) {
    const double d = std::abs(p[k]) - half[k];
    outside += d > 0 ? d * d : 0;
    inside = std::max(inside, d);
  }
  return inside > 0 ? std::sqrt(outside) : inside;
}

}  // namespace

TEST_CASE("bvhquery --slice: layers have the distance at each pixel's centre, on planes across all axes") {
  const TempFolder folder;
  const std::string bvh = folder / "box.bvh", picture = folder / "a.exr";
  check_quiet(run({kBvhBuild, folder.write("box.obj", kBox), "-o", bvh}));
  const int right[3] = {1, 0, 0}, up[3] = {2, 2, 1};
  for (int axis = 0; axis < 3; ++axis)
    for (const double position : {0.0, 0.75}) {
      const std::string plane = std::string(1, "xyz"[axis]) + (position == 0.0 ? "" : "=0.75");
      INFO(plane);
      const auto told = json_of(run({kBvhQuery, bvh, "--slice", plane, "-o", picture, "--size", "60x40", "--json"}));
      CHECK((told["query"] == "signed" && told["position"] == position));
      const ExrFile image = read_exr(picture);
      REQUIRE((image.width == 60 && image.height == 40));
      const double step = 1.2 * std::max((right[axis] == 0 ? 4.0 : 2.0) / 60, 2.0 / 40);
      CHECK(std::abs(told["pixel_size"].get<double>() - step) < 1e-12);
      for (std::uint32_t y = 0; y < 40; ++y)
        for (std::uint32_t x = 0; x < 60; ++x) {
          double p[3];
          p[axis] = position;
          p[right[axis]] = (x - 29.5) * step;
          p[up[axis]] = (19.5 - y) * step;
          const double expected = from_box(p);
          REQUIRE(std::abs(double{image.at("Z", x, y)} - expected) < 1e-6);
          const double near[3] = {image.at("P.X", x, y), image.at("P.Y", x, y), image.at("P.Z", x, y)};
          REQUIRE(std::abs(from_box(near)) < 1e-6);
          REQUIRE(image.uint_at("id.primitive", x, y) < 12);
        }
    }
}

TEST_CASE("bvhquery --slice: orange outside, blue inside, the surface white, grey where nothing is near") {
  const TempFolder folder;
  const std::string bvh = folder / "box.bvh", picture = folder / "a.png";
  check_quiet(run({kBvhBuild, folder.write("box.obj", kBox), "-o", bvh}));
  check_good(run({kBvhQuery, bvh, "--slice", "z", "-o", picture, "--size", "240x120"}));
  const PngFile image = read_png(picture);
  REQUIRE((image.width == 240 && image.height == 120));
  const auto red_minus_blue = [&](std::uint32_t x, std::uint32_t y) { return image.at(x, y, 0) - image.at(x, y, 2); };
  CHECK(red_minus_blue(120, 60) < -40);
  CHECK(red_minus_blue(5, 5) > 40);
  // The right face, x = 2: pixels are 0.02 wide.
  CHECK((image.at(219, 60, 0) > 250 && image.at(219, 60, 1) > 250 && image.at(219, 60, 2) > 250));
  check_good(run({kBvhQuery, bvh, "--slice", "z", "-o", picture, "--size", "240x120", "--max-distance", "0.1"}));
  const PngFile near = read_png(picture);
  CHECK((near.at(120, 60, 0) == near.at(120, 60, 1) && near.at(120, 60, 0) == near.at(120, 60, 2)));
}

TEST_CASE("bvhquery --slice: a scene without triangles, and sizes of one pixel") {
  const TempFolder folder;
  const std::string bvh = folder / "none.bvh", picture = folder / "a.exr";
  CHECK(run({kBvhBuild, folder.write("none.obj", "v 0 0 0\n"), "-o", bvh}).status == 0);
  check_good(run({kBvhQuery, bvh, "--slice", "y=3", "-o", picture, "--size", "1x2"}));
  const ExrFile image = read_exr(picture);
  CHECK((std::isinf(image.at("Z", 0, 1)) && image.uint_at("id.primitive", 0, 1) == kInvalidId));
}

TEST_CASE("Slices: lines are at round numbers, about ten of them") {
  const auto contours = [](float nearest, float farthest) {
    const std::vector<tools::PointRecord> records{{nearest, 0, 0, 0, 0, 0, 0, 0}, {farthest, 0, 0, 0, 0, 0, 0, 0}};
    return tools::scale_of(records).contours;
  };
  CHECK(contours(-1, 0.5f) == 0.1f);
  CHECK(contours(-1, 4.9f) == 0.2f);
  CHECK(contours(0, 72) == 5.0f);
  CHECK(contours(0, 1e-30f) > 0);
  CHECK(contours(0, 0) == 0);
  CHECK(contours(INFINITY, -INFINITY) == 0);
}
