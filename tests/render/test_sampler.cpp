#include <tools/render/studio/sampler.h>

#include <tests/catch.h>

#include <cmath>
#include <set>

using namespace hiprt::tools;

TEST_CASE("Sampler: 256 points of a pixel lie in 256 different cells of every elementary grid") {
  for (std::uint32_t pixel = 0; pixel < 20; ++pixel) {
    const PixelSampler sampler(pixel * 37, pixel * 11, 5);
    for (unsigned columns = 1; columns <= 256; columns *= 2) {
      const unsigned rows = 256 / columns;
      std::set<unsigned> cells;
      for (std::uint32_t i = 0; i < 256; ++i) {
        const auto [u, v] = sampler.point(i, SampleUse::kDirection);
        REQUIRE((u >= 0 && u < 1 && v >= 0 && v < 1));
        const auto column = static_cast<unsigned>(u * static_cast<float>(columns));
        const auto row = static_cast<unsigned>(v * static_cast<float>(rows));
        cells.insert(row * columns + column);
      }
      CHECK(cells.size() == 256);
    }
  }
}

TEST_CASE("Sampler: pixels, uses and seeds have different points; the same has the same") {
  const auto first = PixelSampler(3, 4, 0).point(0, SampleUse::kPixel);
  CHECK(first == PixelSampler(3, 4, 0).point(0, SampleUse::kPixel));
  CHECK(first != PixelSampler(4, 3, 0).point(0, SampleUse::kPixel));
  CHECK(first != PixelSampler(3, 4, 1).point(0, SampleUse::kPixel));
  CHECK(first != PixelSampler(3, 4, 0).point(0, SampleUse::kDirection));
  CHECK(first != PixelSampler(3, 4, 0).point(1, SampleUse::kPixel));
}

TEST_CASE("Sampler: neighbouring pixels and both uses are uncorrelated") {
  const int n = 4096;
  double neighbours = 0, uses = 0, mean = 0;
  for (int i = 0; i < n; ++i) {
    const auto x = static_cast<std::uint32_t>(i % 64), y = static_cast<std::uint32_t>(i / 64);
    const double a = PixelSampler(x, y, 9).point(0, SampleUse::kPixel)[0] - 0.5;
    const double b = PixelSampler(x + 1, y, 9).point(0, SampleUse::kPixel)[0] - 0.5;
    const double c = PixelSampler(x, y, 9).point(0, SampleUse::kDirection)[0] - 0.5;
    mean += a / n, neighbours += 12 * a * b / n, uses += 12 * a * c / n;
  }
  // Five standard deviations.
  CHECK(std::abs(mean) < 5 * 0.289 / 64);
  CHECK(std::abs(neighbours) < 5.0 / 64);
  CHECK(std::abs(uses) < 5.0 / 64);
}
