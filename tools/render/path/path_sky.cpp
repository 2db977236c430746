#include <tools/render/path/path_sky.h>

#include <tools/render/image/color.h>
#include <tools/render/path/path_lights.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace hiprt::tools {
namespace {

Vec3 usable(const Vec3& light) {
  const auto part = [](float x) { return std::isfinite(x) ? std::max(x, 0.0f) : 0.0f; };
  return {part(light.x), part(light.y), part(light.z)};
}

/// From 0 to 1 by the weights; in even steps if there are none. @return their sum.
double add_up(std::span<const double> weights, float* sums) {
  double total = 0.0;
  for (const double weight : weights) total += weight;
  double sum = 0.0;
  const auto count = static_cast<double>(weights.size());
  for (std::size_t i = 0; i < weights.size(); ++i) {
    sums[i] = static_cast<float>(total > 0.0 ? sum / total : static_cast<double>(i) / count);
    sum += weights[i];
  }
  sums[weights.size()] = 1.0f;
  return total;
}

}  // namespace

PathSky make_sky(const std::function<Vec3(const Vec3&)>& light, std::uint32_t size) {
  constexpr unsigned kSubsamples = 2;
  PathSky sky;
  sky.radiance.resize(std::size_t{size} * size);
  sky.rows.resize(size + 1);
  sky.columns.resize(std::size_t{size} * (size + 1));
  std::vector<double> of_rows(size), of_pixels(size);
  const auto coordinate = [&](std::uint32_t i, float offset) {
    return 2.0f * (static_cast<float>(i) + offset) / static_cast<float>(size) - 1.0f;
  };
  for (std::uint32_t y = 0; y < size; ++y) {
    for (std::uint32_t x = 0; x < size; ++x) {
      Vec3 sum(0.0f);
      for (unsigned j = 0; j < kSubsamples; ++j)
        for (unsigned i = 0; i < kSubsamples; ++i) {
          const auto offset = [](unsigned k) { return (static_cast<float>(k) + 0.5f) / kSubsamples; };
          sum += usable(light(Octahedral::direction(coordinate(x, offset(i)), coordinate(y, offset(j)))));
        }
      Vec3& pixel = sky.radiance[std::size_t{y} * size + x];
      pixel = sum / static_cast<float>(kSubsamples * kSubsamples);
      const Vec3 middle = Octahedral::direction(coordinate(x, 0.5f), coordinate(y, 0.5f));
      of_pixels[x] = static_cast<double>(luminance(pixel)) * static_cast<double>(Octahedral::project(middle).stretch);
    }
    of_rows[y] = add_up(of_pixels, sky.columns.data() + std::size_t{y} * (size + 1));
  }
  if (add_up(of_rows, sky.rows.data()) > 0.0) return sky;
  return {};
}

PathSky make_sky(std::span<const Vec3> pixels, std::uint32_t width, std::uint32_t height) {
  const auto pixel = [&](std::int64_t x, std::int64_t y) {
    const auto column = static_cast<std::size_t>((x % width + width) % width);
    const auto row = static_cast<std::size_t>(std::clamp<std::int64_t>(y, 0, height - 1));
    return usable(pixels[row * width + column]);
  };
  const auto light = [&](const Vec3& d) {
    const float turn = 0.5f + std::atan2(d.z, d.x) / (2.0f * kPi);
    const float fall = std::acos(std::clamp(d.y, -1.0f, 1.0f)) / kPi;
    const float x = turn * static_cast<float>(width) - 0.5f, y = fall * static_cast<float>(height) - 0.5f;
    const float left = std::floor(x), top = std::floor(y), right = x - left, below = y - top;
    const auto i = static_cast<std::int64_t>(left), j = static_cast<std::int64_t>(top);
    return (pixel(i, j) * (1.0f - right) + pixel(i + 1, j) * right) * (1.0f - below) +
           (pixel(i, j + 1) * (1.0f - right) + pixel(i + 1, j + 1) * right) * below;
  };
  constexpr std::uint32_t kSmallest = 64, kLargest = 2048;
  return make_sky(light, std::bit_ceil(std::clamp(height, kSmallest, kLargest)));
}

}  // namespace hiprt::tools
