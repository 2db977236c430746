/// Differences of pictures: values known by hand, FLIP against a slow version in double, and changes that must not
/// matter.

#include "slow_flip.h"

#include <tests/oracle/random.h>
#include <tools/render/image/color.h>
#include <tools/render/image/color_map.h>
#include <tools/render/image/flip_color.h>
#include <tools/render/image/flip_filters.h>
#include <tools/render/image/image_compare.h>

#include <tests/catch.h>

#include <cmath>
#include <limits>
#include <numeric>

using namespace hiprt;
using namespace hiprt::tools;
using namespace hiprt::test;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20240611;

ColorImage constant(std::uint32_t width, std::uint32_t height, const Vec3& color) {
  ColorImage image(width, height);
  std::fill(image.colors.begin(), image.colors.end(), color);
  return image;
}

/// Soft shades with hard edges and a few single bright pixels, 0 to 1.
ColorImage scenery(std::uint32_t width, std::uint32_t height, std::uint64_t seed) {
  Random random(seed);
  ColorImage image(width, height);
  const double u = random.uniform(0.02, 0.2), v = random.uniform(0.02, 0.2), bend = random.uniform(0.3, 2.0);
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < width; ++x) {
      const bool inside = std::hypot(x - 0.4 * width, y - 0.5 * height) < 0.3 * std::min(width, height);
      const double shade = 0.5 + 0.4 * std::sin(u * x + v * y), other = 0.5 + 0.4 * std::sin(bend * u * y);
      Vec3 color(static_cast<float>(shade), static_cast<float>(inside ? other : 0.2), static_cast<float>(0.7 * other));
      if (random.below(60) == 0) color = Vec3(random.uniform_float(0, 1), random.uniform_float(0, 1), 1.0f);
      image.colors[std::size_t{y} * width + x] = color;
    }
  return image;
}

/// The same noise at every strength, and no value leaves [0, 1].
ColorImage with_noise(ColorImage image, float strength, std::uint64_t seed) {
  Random random(seed);
  for (Vec3& color : image.colors)
    for (int channel = 0; channel < 3; ++channel) {
      const float target = random.coin() ? 1.0f : 0.0f;
      color[channel] += strength * random.uniform_float(0, 1) * (target - color[channel]);
    }
  return image;
}

ImageDifference difference(const ColorImage& picture, const ColorImage& reference, unsigned threads = 1) {
  auto result = compare(picture, reference, threads);
  REQUIRE(result.has_value());
  return std::move(*result);
}

ColorImage mirrored(const ColorImage& image) {
  ColorImage result = image;
  for (std::uint32_t y = 0; y < image.height; ++y)
    std::reverse(result.colors.begin() + y * image.width, result.colors.begin() + (y + 1) * image.width);
  return result;
}

ColorImage transposed(const ColorImage& image) {
  ColorImage result(image.height, image.width);
  for (std::uint32_t y = 0; y < image.height; ++y)
    for (std::uint32_t x = 0; x < image.width; ++x)
      result.colors[std::size_t{x} * image.height + y] = image.colors[std::size_t{y} * image.width + x];
  return result;
}

std::string refusal(const ColorImage& picture, const ColorImage& reference) {
  const auto result = compare(picture, reference, 1);
  REQUIRE_FALSE(result.has_value());
  CHECK(result.error().code == build::ErrorCode::kInvalidInput);
  return result.error().message;
}

}  // namespace

TEST_CASE("Differences: equal pictures have none, whether dark, bright or extremely bright") {
  INFO("seed " << kSeed);
  const ColorImage image = scenery(70, 90, kSeed);
  ColorImage bright = image;
  for (Vec3& color : bright.colors) color *= 1000.0f;
  for (const ColorImage& same : {image, bright, constant(3, 2, Vec3(0)), constant(1, 1, Vec3(3e38f))}) {
    const ImageDifference none = difference(same, same);
    CHECK(none.mse == 0.0);
    CHECK(none.relative_mse == 0.0);
    CHECK(none.psnr == std::numeric_limits<double>::infinity());
    CHECK(none.flip == 0.0);
    CHECK(none.flip_map == std::vector<float>(same.colors.size(), 0.0f));
  }
}

TEST_CASE("Differences: errors of a few pixels, by hand") {
  ColorImage picture(2, 1), reference(2, 1);
  reference.colors = {Vec3(1.0f, 0.5f, 0.0f), Vec3(0.25f, 0.25f, 0.25f)};
  picture.colors = {Vec3(0.5f, 0.5f, 0.25f), Vec3(0.25f, 0.5f, 0.25f)};
  const ImageDifference found = difference(picture, reference);
  CHECK(found.mse == Approx((0.25 + 0.0625 + 0.0625) / 6));
  CHECK(found.relative_mse == Approx((0.25 / 1.01 + 0.0625 / 0.01 + 0.0625 / (0.0625 + 0.01)) / 6));
  // sRGB of 1, 1/2, 1/4 and 0: 255, 188, 137 and 0.
  CHECK(found.psnr == Approx(10 * std::log10(255.0 * 255.0 / ((67.0 * 67 + 137.0 * 137 + 51.0 * 51) / 6))));
  const auto gray = [](unsigned byte) {
    return constant(40, 30, Vec3(linear_from_srgb(static_cast<float>(byte) / 255.0f)));
  };
  CHECK(difference(gray(110), gray(100)).psnr == Approx(20 * std::log10(25.5)));
  CHECK(difference(gray(255), gray(0)).psnr == Approx(0.0).margin(1e-12));
}

TEST_CASE("Differences: the reference's brightest pixel is the white of both") {
  ColorImage picture(2, 1), reference(2, 1);
  reference.colors = {Vec3(4.0f), Vec3(1.0f)};
  picture.colors = {Vec3(1.0f), Vec3(100.0f)};
  // Reinhard's operator with white 4: 1 becomes (1 + 1/16) / 2, 100 is past 1.
  const double low = srgb_byte(0.53125f), step = 255.0 - low;
  CHECK(difference(picture, reference).psnr == Approx(10 * std::log10(255.0 * 255.0 / (step * step))));
  // Errors above white are invisible and do not count.
  picture.colors[1] = Vec3(1e30f);
  CHECK(difference(picture, reference).psnr == Approx(10 * std::log10(255.0 * 255.0 / (step * step))));
  CHECK(difference(picture, reference).mse == Approx((9.0 + 1e60) / 2));
}

TEST_CASE("Differences: any finite values give finite errors") {
  const float most = std::numeric_limits<float>::max();
  const std::vector<Vec3> odd{Vec3(most), Vec3(-most), Vec3(most, 0, -1), Vec3(-1), Vec3(1e-45f), Vec3(0)};
  for (const Vec3& a : odd)
    for (const Vec3& b : odd) {
      const ImageDifference found = difference(constant(2, 2, a), constant(2, 2, b));
      CHECK(std::isfinite(found.mse));
      CHECK(std::isfinite(found.relative_mse));
      CHECK_FALSE(std::isnan(found.psnr));
      CHECK((found.flip >= 0.0 && found.flip <= 1.0));
    }
}

TEST_CASE("Differences: pictures that cannot be compared are refused with the reason") {
  const ColorImage image = constant(4, 3, Vec3(0.5f));
  CHECK(refusal(image, constant(3, 4, Vec3(0.5f))) == "the picture has 4 x 3 pixels, the reference 3 x 4");
  CHECK(refusal(constant(0, 3, Vec3(0)), constant(0, 3, Vec3(0))) == "the pictures have no pixels");
  ColorImage bad = image;
  bad.colors[6].y = std::numeric_limits<float>::quiet_NaN();
  CHECK(refusal(bad, image) == "the picture: channel G of pixel 2, 1 is not finite");
  bad.colors[6].y = 0.0f;
  bad.colors[11].z = -std::numeric_limits<float>::infinity();
  CHECK(refusal(image, bad) == "the reference: channel B of pixel 3, 2 is not finite");
}

TEST_CASE("Differences: they grow with the strength of noise") {
  INFO("seed " << kSeed);
  const ColorImage reference = scenery(96, 80, kSeed);
  ImageDifference last = difference(reference, reference);
  for (const float strength : {0.01f, 0.03f, 0.1f, 0.2f, 0.4f, 0.8f, 1.0f}) {
    INFO("strength " << strength);
    const ImageDifference found = difference(with_noise(reference, strength, kSeed + 1), reference);
    CHECK(found.mse > last.mse);
    CHECK(found.relative_mse > last.relative_mse);
    CHECK(found.psnr < last.psnr);
    CHECK(found.flip > last.flip);
    last = found;
  }
}

TEST_CASE("Differences: the same bits on any number of threads") {
  INFO("seed " << kSeed);
  const ColorImage reference = scenery(50, 333, kSeed), picture = with_noise(reference, 0.3f, kSeed);
  const ImageDifference one = difference(picture, reference, 1);
  for (const unsigned threads : {2u, 3u, 8u, 0u}) {
    const ImageDifference more = difference(picture, reference, threads);
    CHECK((more.mse == one.mse && more.relative_mse == one.relative_mse && more.psnr == one.psnr));
    CHECK((more.flip == one.flip && more.flip_map == one.flip_map));
  }
}

TEST_CASE("FLIP: equals a step-by-step computation in double precision, in every pixel") {
  double worst = 0.0;
  const auto agree = [&](const ColorImage& picture, const ColorImage& reference) {
    const ImageDifference fast = difference(picture, reference, 2);
    const std::vector<double> slow = SlowFlip().map(picture, reference);
    REQUIRE(fast.flip_map.size() == slow.size());
    for (std::size_t i = 0; i < slow.size(); ++i) worst = std::max(worst, std::abs(fast.flip_map[i] - slow[i]));
    CHECK(fast.flip ==
          Approx(std::accumulate(slow.begin(), slow.end(), 0.0) / static_cast<double>(slow.size())).margin(1e-7));
    CHECK(worst < 1e-6);
  };
  // Smaller than the filters, larger, and of several bands of rows.
  const std::vector<std::pair<std::uint32_t, std::uint32_t>> sizes{{1, 1}, {1, 9}, {7, 1}, {5, 6}, {37, 29}, {11, 140}};
  std::uint64_t seed = kSeed;
  for (const auto& [width, height] : sizes)
    for (const float strength : {0.02f, 0.3f, 1.0f}) {
      INFO(width << " x " << height << ", noise " << strength << ", seed " << seed);
      const ColorImage reference = scenery(width, height, seed);
      agree(with_noise(reference, strength, seed + 1), reference);
      agree(scenery(width, height, seed + 2), reference);
      seed += 3;
    }
  INFO("largest difference of a pixel " << worst);
  CHECK(worst > 0.0);
}

TEST_CASE("FLIP: whole pictures of one colour, by formula") {
  const auto of = [](const Vec3& a, const Vec3& b) {
    return difference(constant(30, 20, a), constant(30, 20, b)).flip;
  };
  // Green and blue are the largest difference that there is.
  CHECK(of(Vec3(0, 1, 0), Vec3(0, 0, 1)) == Approx(1.0).margin(1e-7));
  CHECK(of(Vec3(0), Vec3(1)) == Approx(redistributed(std::pow(100.0, 0.7))).margin(1e-7));
  CHECK(of(Vec3(0), Vec3(1)) == Approx(0.9674).margin(1e-4));
  // Grays differ in L* alone.
  CHECK(of(Vec3(0.5f), Vec3(0.25f)) ==
        Approx(redistributed(std::pow(116.0 * (std::cbrt(0.5) - std::cbrt(0.25)), 0.7))).margin(1e-7));
}

TEST_CASE("FLIP: which picture is the reference does not matter, nor does turning both") {
  INFO("seed " << kSeed);
  const ColorImage a = scenery(61, 83, kSeed), b = with_noise(scenery(61, 83, kSeed + 5), 0.2f, kSeed);
  const ImageDifference there = difference(a, b), back = difference(b, a);
  CHECK(there.flip_map == back.flip_map);
  CHECK((there.flip == back.flip && there.mse == back.mse && there.psnr == back.psnr));
  const ImageDifference mirror = difference(mirrored(a), mirrored(b)), turn = difference(transposed(a), transposed(b));
  double worst = 0.0;
  for (std::uint32_t y = 0; y < a.height; ++y)
    for (std::uint32_t x = 0; x < a.width; ++x) {
      const float here = there.flip_map[std::size_t{y} * a.width + x];
      worst = std::max<double>(worst, std::abs(here - mirror.flip_map[std::size_t{y} * a.width + (a.width - 1 - x)]));
      worst = std::max<double>(worst, std::abs(here - turn.flip_map[std::size_t{x} * a.height + y]));
    }
  CHECK(worst < 1e-6);
}

TEST_CASE("FLIP: a difference is where it is, and a sharper one counts more") {
  const ColorImage gray = constant(101, 101, Vec3(0.2f));
  ColorImage dot = gray, smear = gray;
  dot.colors[50 * 101 + 50] = Vec3(1.0f);
  const ImageDifference found = difference(dot, gray);
  const auto at = [&](std::size_t x, std::size_t y) { return found.flip_map[y * 101 + x]; };
  CHECK(at(50, 50) == *std::max_element(found.flip_map.begin(), found.flip_map.end()));
  CHECK(at(50, 50) > 0.2f);
  // Three standard deviations of the widest filter are 10 pixels.
  CHECK(at(50, 39) == 0.0f);
  CHECK(at(39, 50) == 0.0f);
  CHECK(at(50, 45) > 0.0f);
  // The same light over 5 x 5 pixels is seen less at its middle.
  for (std::size_t y = 48; y <= 52; ++y)
    for (std::size_t x = 48; x <= 52; ++x) smear.colors[y * 101 + x] = Vec3(0.2f + 0.8f / 25);
  CHECK(difference(smear, gray).flip_map[50 * 101 + 50] < at(50, 50));
}

TEST_CASE("FLIP: filters keep constants, and derivatives of constants are 0") {
  const FlipFilters filters = flip_filters();
  CHECK(filters.sensitivity_radius == 10);
  CHECK(filters.feature_radius == 9);
  const auto sum = [](const Kernel& kernel) { return std::accumulate(kernel.begin(), kernel.end(), 0.0); };
  const auto volume = [&](const Kernel& kernel) { return sum(kernel) * sum(kernel); };
  CHECK(volume(filters.achromatic) == Approx(1.0).epsilon(1e-12));
  CHECK(volume(filters.red_green) == Approx(1.0).epsilon(1e-12));
  CHECK(volume(filters.blue_yellow_first) + volume(filters.blue_yellow_second) == Approx(1.0).epsilon(1e-12));
  CHECK(volume(filters.smooth) == Approx(1.0).epsilon(1e-12));
  CHECK(sum(filters.slope) == Approx(0.0).margin(1e-12));
  CHECK(sum(filters.curvature) == Approx(0.0).margin(1e-12));
  for (const Vec3& color : {Vec3(0), Vec3(1), Vec3(0.1f, 0.5f, 0.9f)}) {
    const Color back = linear_from_opponent(opponent_from_linear(color));
    for (int channel = 0; channel < 3; ++channel)
      CHECK(back[static_cast<std::size_t>(channel)] == Approx(color[channel]).margin(1e-12));
  }
}

TEST_CASE("FLIP: its picture has the map's colours") {
  const ColorImage a = constant(2, 1, Vec3(0.2f));
  ImageDifference found = difference(a, a);
  found.flip_map = {0.0f, 1.0f};
  const Image picture = flip_picture(found);
  CHECK((picture.width == 2 && picture.height == 1));
  CHECK(picture.at(0, 0).color == viridis(0.0f));
  CHECK(picture.at(1, 0).color == viridis(1.0f));
}
