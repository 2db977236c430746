#include <tools/render/image/image_compare.h>

#include <tools/base/errors.h>
#include <tools/render/image/color_map.h>
#include <tools/render/image/flip.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace hiprt::tools {
namespace {

/// Rows per batch of threads.
constexpr std::size_t kBatchRows = 16;

struct Sums {
  double squares = 0.0, relative = 0.0, bytes = 0.0;
};

Sums operator+(const Sums& a, const Sums& b) {
  return {a.squares + b.squares, a.relative + b.relative, a.bytes + b.bytes};
}

std::string size_text(const ColorImage& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height);
}

/// Calls add(sums, i) for every pixel. Rows are summed up alone and then in their order: the same on all threads.
template <class Add> Sums sum_over(const ColorImage& image, const ThreadLimit& limit, const Add& add) {
  std::vector<Sums> rows(image.height);
  parallel_batches(image.height, kBatchRows, limit, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y)
      for (std::size_t i = y * image.width; i < (y + 1) * image.width; ++i) add(rows[y], i);
  });
  return std::accumulate(rows.begin(), rows.end(), Sums{});
}

void add_errors(Sums& sums, const Vec3& picture, const Vec3& reference) {
  constexpr double kFloor = 0.01;
  for (int channel = 0; channel < 3; ++channel) {
    const double r = reference[channel], d = picture[channel] - r;
    sums.squares += d * d;
    sums.relative += d * d / (r * r + kFloor);
  }
}

/// No channel is below 0 or so large that the tone mapping overflows.
Vec3 limited(const Vec3& color) {
  constexpr float kMost = 1e18f;
  return {std::clamp(color.x, 0.0f, kMost), std::clamp(color.y, 0.0f, kMost), std::clamp(color.z, 0.0f, kMost)};
}

float brightest(const ColorImage& image) {
  float white = 1.0f;
  for (const Vec3& color : image.colors) white = std::max(white, luminance(limited(color)));
  return white;
}

/// Linear light, 0 to 1.
void display(ColorImage& image, float white, const ThreadLimit& limit) {
  parallel_batches(image.colors.size(), kBatchRows * image.width, limit, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 shown = reinhard(limited(image.colors[i]), white);
      image.colors[i] = {std::min(shown.x, 1.0f), std::min(shown.y, 1.0f), std::min(shown.z, 1.0f)};
    }
  });
}

void add_bytes(Sums& sums, const Vec3& picture, const Vec3& reference) {
  for (int channel = 0; channel < 3; ++channel) {
    const double d = srgb_byte(picture[channel]) - srgb_byte(reference[channel]);
    sums.bytes += d * d;
  }
}

double peak_ratio(double mean_square) {
  return mean_square > 0.0 ? 10.0 * std::log10(255.0 * 255.0 / mean_square) : std::numeric_limits<double>::infinity();
}

build::Result<void> check_both(const ColorImage& picture, const ColorImage& reference) {
  if (picture.width != reference.width || picture.height != reference.height)
    return fail(build::ErrorCode::kInvalidInput,
                "the picture has " + size_text(picture) + " pixels, the reference " + size_text(reference));
  if (picture.colors.empty()) return fail(build::ErrorCode::kInvalidInput, "the pictures have no pixels");
  if (auto finite = check_finite(picture, "the picture"); !finite) return finite;
  return check_finite(reference, "the reference");
}

}  // namespace

build::Result<void> check_finite(const ColorImage& image, const std::string& name) {
  for (std::size_t i = 0; i < image.colors.size(); ++i)
    for (int channel = 0; channel < 3; ++channel)
      if (!std::isfinite(image.colors[i][channel]))
        return fail(build::ErrorCode::kInvalidInput, name + ": channel " + "RGB"[channel] + " of pixel " +
                                                         std::to_string(i % image.width) + ", " +
                                                         std::to_string(i / image.width) + " is not finite");
  return {};
}

build::Result<ImageDifference> compare(ColorImage picture, ColorImage reference, unsigned threads) {
  if (auto checked = check_both(picture, reference); !checked) return tl::unexpected(checked.error());
  const ThreadLimit limit(threads);
  const auto values = 3.0 * static_cast<double>(picture.colors.size());
  const Sums linear = sum_over(
      picture, limit, [&](Sums& sums, std::size_t i) { add_errors(sums, picture.colors[i], reference.colors[i]); });
  const float white = brightest(reference);
  display(picture, white, limit);
  display(reference, white, limit);
  const Sums displayed = sum_over(
      picture, limit, [&](Sums& sums, std::size_t i) { add_bytes(sums, picture.colors[i], reference.colors[i]); });
  std::vector<float> map = flip_map(picture, reference, limit);
  // Interrupted once, always: the sums before are whole if the map is.
  if (map.empty()) return fail(build::ErrorCode::kCancelled, "cancelled while the picture was compared");
  const double flip = std::accumulate(map.begin(), map.end(), 0.0) / static_cast<double>(map.size());
  return ImageDifference{linear.squares / values,
                         linear.relative / values,
                         peak_ratio(displayed.bytes / values),
                         flip,
                         picture.width,
                         picture.height,
                         std::move(map)};
}

Image flip_picture(const ImageDifference& difference) {
  Image image(difference.width, difference.height);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i].color = viridis(difference.flip_map[i]);
  return image;
}

}  // namespace hiprt::tools
