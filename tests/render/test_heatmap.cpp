#include <hiprt_device/math/vec_functions.h>
#include <tools/render/image/color_map.h>
#include <tools/render/studio/heatmap.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::tools;

namespace {

bool equal(const Vec3& a, const Vec3& b) { return glm::length(a - b) < 1e-6f; }

}  // namespace

TEST_CASE("Colour map: viridis as published, clamped, and brighter with every step") {
  // The table's first, middle and last entries of matplotlib 3.6, 8-bit display values.
  const auto check = [](float t, int red, int green, int blue) {
    const Vec3 color = viridis(t);
    CHECK(std::abs(srgb_byte(color.x) - red) <= 1);
    CHECK(std::abs(srgb_byte(color.y) - green) <= 1);
    CHECK(std::abs(srgb_byte(color.z) - blue) <= 1);
  };
  check(0.0f, 68, 1, 84);
  check(0.5f, 33, 144, 140);
  check(1.0f, 253, 231, 37);
  check(-1.0f, 68, 1, 84);
  check(7.0f, 253, 231, 37);
  for (int i = 0; i < 256; ++i)
    CHECK(luminance(viridis(static_cast<float>(i + 1) / 256)) > luminance(viridis(static_cast<float>(i) / 256)));
}

TEST_CASE("Heat map: the range is round, covers 99.5 % of the pixels and says whether it covers all") {
  const auto range_of = [](std::vector<float> cost) { return heat_range(cost); };
  CHECK(range_of({}).top == 4);
  CHECK(range_of({0, 0, 0}).top == 4);
  CHECK(range_of(std::vector<float>(10, 4.0f)).top == 4);
  CHECK(range_of(std::vector<float>(10, 4.1f)).top == 8);
  CHECK(range_of(std::vector<float>(10, 97.0f)).top == 100);
  CHECK(range_of(std::vector<float>(10, 121.0f)).top == 160);
  CHECK(range_of(std::vector<float>(10, 12345.0f)).top == 16000);
  for (float value = 1; value < 2e9f; value *= 1.37f) {
    const HeatRange range = range_of({value});
    CHECK(range.top % 4 == 0);
    CHECK((static_cast<float>(range.top) >= value || value > 1.2e9f));
    CHECK((static_cast<float>(range.top) <= 1.7f * value || range.top == 4 || value < 12));
  }
  std::vector<float> cost(1000, 10.0f);
  CHECK_FALSE(heat_range(cost).clipped);
  for (std::size_t i = 0; i < 5; ++i) cost[i * 100] = 500.0f;
  CHECK(heat_range(cost).top == 12);
  CHECK(heat_range(cost).clipped);
  for (std::size_t i = 0; i < 6; ++i) cost[i * 100 + 1] = 500.0f;
  CHECK(heat_range(cost).top == 600);
  CHECK_FALSE(heat_range(cost).clipped);
}

TEST_CASE("Heat map: pixels have their cost's colour, the legend its bar and its numbers") {
  Image image(640, 480);
  std::vector<float> cost(image.pixels.size(), 25.0f);
  cost[0] = 100.0f;
  cost[640 * 10 + 20] = 0.0f;
  apply_heatmap(image, cost);
  CHECK(equal(image.at(0, 0).color, viridis(1)));  // 100 of 32: clipped.
  CHECK(equal(image.at(20, 10).color, viridis(0)));
  CHECK(equal(image.at(320, 100).color, viridis(25.0f / 32.0f)));
}

TEST_CASE("Legend: columns are as high as their counts' square roots, and every nonzero count is visible") {
  std::vector<std::uint64_t> counts(kLegendParts, 0);
  counts[0] = 1000;
  counts[1] = 250;
  counts[2] = 1;
  for (const auto& [width, height] : {std::pair{200u, 71u}, {1920u, 1080u}}) {
    Image image(width, height);
    const auto area = draw_legend(image, {"tests", 40, false, counts});
    REQUIRE(area.has_value());
    const std::uint32_t column = (area->bar_right - area->bar_left) / std::uint32_t{kLegendParts}, size = column / 4;
    const auto column_height = [&](std::uint32_t i) {
      const Vec3 color = viridis((static_cast<float>(i) + 0.5f) / kLegendParts);
      std::uint32_t rows = 0;
      for (std::uint32_t y = area->top; y < area->bar_top; ++y)
        rows += equal(image.at(area->bar_left + i * column + column / 2, y).color, color) ? 1 : 0;
      return rows;
    };
    CHECK(column_height(0) == 20 * size);
    CHECK(column_height(1) == 10 * size);
    CHECK((column_height(2) >= 1 && column_height(2) <= size));
    CHECK(column_height(3) == 0);
  }
  Image low(200, 70);
  CHECK_FALSE(draw_legend(low, {"tests", 40, false, counts}));
}

TEST_CASE("Legend: a dark panel at the bottom left with the whole colour map and light text") {
  for (const auto& [width, height] : {std::pair{640u, 480u}, {1920u, 1080u}, {200u, 48u}, {4000u, 60u}}) {
    Image image(width, height);
    for (Pixel& pixel : image.pixels) pixel.color = Vec3(0.5f);
    const auto area = draw_legend(image, {"box + leaf tests per ray", 120, true});
    REQUIRE(area.has_value());
    CHECK(area->right <= width);
    CHECK(area->bottom <= height);
    const std::uint32_t middle = (area->bar_top + area->bar_bottom) / 2;
    CHECK(equal(image.at(area->bar_left, middle).color, viridis(0)));
    CHECK(equal(image.at(area->bar_right - 1, middle).color, viridis(1)));
    std::size_t ink_above = 0, ink_below = 0, dark = 0;
    for (std::uint32_t y = 0; y < height; ++y)
      for (std::uint32_t x = 0; x < width; ++x) {
        const float value = image.at(x, y).color.x;
        const bool inside = x >= area->left && x < area->right && y >= area->top && y < area->bottom;
        if (!inside && value != 0.5f) FAIL("drawn outside at " << x << ", " << y);
        if (inside && y < area->bar_top && value > 0.8f) ++ink_above;
        if (inside && y >= area->bar_bottom && value > 0.8f) ++ink_below;
        if (inside && value < 0.1f) ++dark;
      }
    CHECK(ink_above > 200);
    CHECK(ink_below > 100);
    CHECK(dark > ink_above + ink_below);
  }
}

TEST_CASE("Legend: different numbers look different, and a small picture has none") {
  Image first(400, 300), second(400, 300), clipped(400, 300);
  REQUIRE(draw_legend(first, {"tests", 120, false}));
  REQUIRE(draw_legend(second, {"tests", 160, false}));
  REQUIRE(draw_legend(clipped, {"tests", 120, true}));
  const auto differ = [](const Image& a, const Image& b) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) count += a.pixels[i].color != b.pixels[i].color ? 1 : 0;
    return count;
  };
  CHECK(differ(first, second) > 20);
  CHECK(differ(first, clipped) == 9);  // The plus.
  Image small(150, 100), low(640, 30);
  CHECK_FALSE(draw_legend(small, {"tests", 120, false}));
  CHECK_FALSE(draw_legend(low, {"tests", 120, false}));
  for (const Pixel& pixel : small.pixels) REQUIRE(pixel.color == Vec3(0.0f));
}
