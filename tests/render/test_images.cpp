#include "read_images.h"

#include <hiprt_device/math/vec_functions.h>
#include <tests/tools/temp_folder.h>
#include <tools/render/image/color.h>
#include <tools/render/image/image.h>
#include <tools/render/image/image_write.h>

#include <tests/catch.h>

#include <cmath>

using namespace hiprt;
using namespace hiprt::tools;
using namespace hiprt::test;
using Catch::Contains;

namespace {

/// Every pixel different in every channel, one of them a miss.
Image sample_image() {
  Image image(5, 3);
  float next = 0.0f;
  for (Pixel& pixel : image.pixels) {
    pixel.color = Vec3(next + 0.01f, next + 0.02f, next + 0.03f);
    pixel.normal = Vec3(-next, next + 0.25f, 1.0f);
    pixel.position = Vec3(next * 1e10f, -next * 1e-30f, next + 0.5f);
    pixel.depth = next + 0.125f;
    pixel.geometry = static_cast<std::uint32_t>(next * 100.0f);
    pixel.primitive = 0x80000000u + pixel.geometry;
    pixel.box_tests = pixel.geometry + 1;
    pixel.leaf_tests = pixel.geometry + 2;
    pixel.triangle_tests = pixel.geometry + 3;
    next += 0.0625f;
  }
  image.at(2, 1) = Pixel{};
  return image;
}

}  // namespace

TEST_CASE("EXR: every channel of every pixel is read back, also misses and attributes") {
  const TempFolder folder;
  const Image image = sample_image();
  const auto bytes = write_exr(folder / "a.exr", image, {{"software", "bvhrender 1"}, {"camera", "x/y"}});
  REQUIRE(bytes.has_value());
  CHECK(*bytes == std::filesystem::file_size(folder / "a.exr"));
  const ExrFile file = read_exr(folder / "a.exr");
  CHECK(file.width == 5);
  CHECK(file.height == 3);
  CHECK(file.floats.size() == 11);
  CHECK(file.uints.size() == 6);
  CHECK(file.attributes.at("software") == "bvhrender 1");
  CHECK(file.attributes.at("camera") == "x/y");
  for (std::uint32_t y = 0; y < 3; ++y)
    for (std::uint32_t x = 0; x < 5; ++x) {
      const Pixel& p = image.at(x, y);
      CHECK((file.at("R", x, y) == p.color.x && file.at("G", x, y) == p.color.y && file.at("B", x, y) == p.color.z));
      CHECK(Vec3(file.at("N.X", x, y), file.at("N.Y", x, y), file.at("N.Z", x, y)) == p.normal);
      CHECK(Vec3(file.at("P.X", x, y), file.at("P.Y", x, y), file.at("P.Z", x, y)) == p.position);
      CHECK(file.at("Z", x, y) == p.depth);
      CHECK(file.uint_at("id.geometry", x, y) == p.geometry);
      CHECK(file.uint_at("id.primitive", x, y) == p.primitive);
      CHECK(file.uint_at("cost.boxes", x, y) == p.box_tests);
      CHECK(file.uint_at("cost.leaves", x, y) == p.leaf_tests);
      CHECK(file.uint_at("cost.triangles", x, y) == p.triangle_tests);
    }
  CHECK(std::isinf(file.at("Z", 2, 1)));
  CHECK(file.uint_at("id.geometry", 2, 1) == 0xffffffffu);
  CHECK(folder.names() == std::vector<std::string>{"a.exr"});
}

TEST_CASE("PNG: sRGB bytes of known colours, top row first") {
  const TempFolder folder;
  Image image(3, 2);
  image.at(0, 0).color = Vec3(0.0f, 0.5f, 1.0f);
  image.at(1, 0).color = Vec3(-1.0f, 0.0031308f, 0.2140f);
  image.at(2, 1).color = Vec3(1.0f, 0.0f, 0.0f);
  const auto bytes = write_png(folder / "a.png", image);
  REQUIRE(bytes.has_value());
  CHECK(*bytes == std::filesystem::file_size(folder / "a.png"));
  const PngFile file = read_png(folder / "a.png");
  REQUIRE((file.width == 3 && file.height == 2));
  const std::vector<unsigned char> expected{0, 188, 255, 0, 10, 127, 0, 0, 0, 0, 0, 0, 0, 0, 0, 255, 0, 0};
  CHECK(file.bytes == expected);
  CHECK(folder.names() == std::vector<std::string>{"a.png"});
}

TEST_CASE("PNG: colours above 1 are brought into range and keep their order") {
  const TempFolder folder;
  Image image(4, 1);
  for (std::uint32_t x = 0; x < 4; ++x) image.at(x, 0).color = Vec3(static_cast<float>(x) + 1.0f);
  REQUIRE(write_png(folder / "a.png", image));
  const PngFile file = read_png(folder / "a.png");
  CHECK(file.at(3, 0, 0) == 255);
  CHECK(file.at(2, 0, 0) < 255);
  CHECK(file.at(1, 0, 0) < file.at(2, 0, 0));
  // Reinhard, L = 1, white 4: (1 + 1/16) / 2.
  CHECK(file.at(0, 0, 0) == srgb_byte(0.53125f));
}

TEST_CASE("Pictures: a path that cannot be written is an error with its name, and leaves no file") {
  const TempFolder folder;
  std::filesystem::create_directory(folder / "taken.exr");
  std::filesystem::create_directory(folder / "taken.png");
  const Image image = sample_image();
  CHECK_THAT(write_exr(folder / "taken.exr", image, {}).error().message, Contains("taken.exr"));
  CHECK_THAT(write_png(folder / "taken.png", image).error().message, Contains("taken.png"));
  CHECK_THAT(write_exr(folder / "none/a.exr", image, {}).error().message, Contains("a.exr"));
  CHECK_THAT(write_png(folder / "none/a.png", image).error().message, Contains("a.png"));
  CHECK(folder.names() == std::vector<std::string>{"taken.exr", "taken.png"});
}

TEST_CASE("Colours: the sRGB functions are inverses, and Reinhard's operator with white 1 changes nothing") {
  for (int i = 0; i <= 255; ++i) {
    const float display = static_cast<float>(i) / 255.0f;
    CHECK(srgb_byte(linear_from_srgb(display)) == i);
  }
  const Vec3 color(0.1f, 0.7f, 0.3f);
  CHECK(glm::length(reinhard(color, 1.0f) - color) < 1e-6f);
}
