#include <tools/render/image/flip.h>

#include <tools/render/image/flip_color.h>
#include <tools/render/image/flip_filters.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace hiprt::tools {
namespace {

/// Rows that are filtered together: few repeat their neighbours' work, and their planes stay small.
constexpr std::size_t kBandRows = 64;

/// What FLIP compares, of the pixels of one row.
struct Perceived {
  explicit Perceived(std::size_t width) : lab(width), edges(width), points(width) {}

  std::vector<Color> lab;             ///< Filtered, Hunt-adjusted.
  std::vector<double> edges, points;  ///< Strengths.
};

/// The filters over a few rows of a picture: along all rows first, then, row by row, across.
class BandFilter {
 public:
  /// @pre begin < end <= image.height.
  BandFilter(const ColorImage& image, const FlipFilters& filters, std::size_t begin, std::size_t end)
      : filters_(filters), width_(image.width), begin_(begin), margin_(filters.sensitivity_radius) {
    const std::size_t rows = end - begin + 2 * margin_;
    for (auto& plane : planes_) plane.resize(rows * width_);
    for (auto& line : scratch_) line.resize(width_ + 2 * margin_);
    for (std::size_t row = 0; row < rows; ++row) filter_along(image, row);
  }

  void perceive(std::size_t y, Perceived& out) {
    perceive_colors(y - begin_, out.lab);
    perceive_features(y - begin_, kSlope, filters_.slope, out.edges);
    perceive_features(y - begin_, kCurvature, filters_.curvature, out.points);
  }

 private:
  enum Plane { kAchromatic, kRedGreen, kBlueYellow1, kBlueYellow2, kSlope, kCurvature, kSmooth, kPlanes };

  /// A row of the band and its margin, of the picture's nearest row.
  void filter_along(const ColorImage& image, std::size_t row) {
    const std::size_t y = std::min(std::max(begin_ + row, margin_) - margin_, std::size_t{image.height} - 1);
    const Vec3* const colors = image.colors.data() + y * width_;
    for (std::size_t i = 0; i < width_ + 2 * margin_; ++i) {
      const std::size_t x = std::min(std::max(i, margin_) - margin_, width_ - 1);
      const Color opponent = opponent_from_linear(colors[x]);
      for (std::size_t channel = 0; channel < 3; ++channel) scratch_[channel][i] = opponent[channel];
    }
    const auto along = [&](Plane plane, std::size_t channel, const Kernel& kernel) {
      const std::size_t radius = kernel.size() / 2;
      weighted_sum(scratch_[channel].data() + margin_ - radius, 1, kernel, planes_[plane].data() + row * width_,
                   width_);
    };
    along(kAchromatic, 0, filters_.achromatic);
    along(kRedGreen, 1, filters_.red_green);
    along(kBlueYellow1, 2, filters_.blue_yellow_first);
    along(kBlueYellow2, 2, filters_.blue_yellow_second);
    along(kSlope, 0, filters_.slope);
    along(kCurvature, 0, filters_.curvature);
    along(kSmooth, 0, filters_.smooth);
  }

  /// @return the pixels of a row, in a line that the next call for @p line replaces.
  const double* across(std::size_t row, Plane plane, const Kernel& kernel, std::size_t line) {
    const std::size_t radius = kernel.size() / 2;
    weighted_sum(planes_[plane].data() + (row + margin_ - radius) * width_, width_, kernel, scratch_[line].data(),
                 width_);
    return scratch_[line].data();
  }

  void perceive_colors(std::size_t row, std::vector<Color>& lab) {
    const double* const achromatic = across(row, kAchromatic, filters_.achromatic, 0);
    const double* const red_green = across(row, kRedGreen, filters_.red_green, 1);
    const double* const first = across(row, kBlueYellow1, filters_.blue_yellow_first, 2);
    const double* const second = across(row, kBlueYellow2, filters_.blue_yellow_second, 3);
    for (std::size_t x = 0; x < width_; ++x) {
      Color linear = linear_from_opponent({achromatic[x], red_green[x], first[x] + second[x]});
      for (double& value : linear) value = std::clamp(value, 0.0, 1.0);
      lab[x] = hunt_lab_from_linear(linear);
    }
  }

  /// The length of a derivative's vector, along and across.
  void perceive_features(std::size_t row, Plane derived, const Kernel& derive, std::vector<double>& strength) {
    const double* const along = across(row, derived, filters_.smooth, 0);
    const double* const upright = across(row, kSmooth, derive, 1);
    for (std::size_t x = 0; x < width_; ++x) strength[x] = std::sqrt(along[x] * along[x] + upright[x] * upright[x]);
  }

  const FlipFilters& filters_;
  std::size_t width_, begin_, margin_;
  std::array<std::vector<double>, kPlanes> planes_;
  std::array<std::vector<double>, 4> scratch_;
};

constexpr double kColorExponent = 0.7;

/// Of two displayed colours, to the power of kColorExponent: green and blue.
double largest_difference() {
  const double distance = hyab_distance(hunt_lab_from_linear({0, 1, 0}), hunt_lab_from_linear({0, 0, 1}));
  return std::pow(distance, kColorExponent);
}

/// 0 to 1: differences up to 40 % of the largest take the first 95 %.
double color_difference(const Color& a, const Color& b, double largest) {
  constexpr double kBend = 0.4, kBentTo = 0.95;
  const double part = std::pow(hyab_distance(a, b), kColorExponent) / largest;
  if (part < kBend) return part * (kBentTo / kBend);
  return std::min(kBentTo + (part - kBend) * ((1.0 - kBentTo) / (1.0 - kBend)), 1.0);
}

void compare_row(const Perceived& a, const Perceived& b, float* out) {
  const double largest = largest_difference(), half_root = std::sqrt(0.5);  // Both vectors are shorter than sqrt(2).
  for (std::size_t x = 0; x < a.lab.size(); ++x) {
    const double color = color_difference(a.lab[x], b.lab[x], largest);
    const double edges = std::abs(a.edges[x] - b.edges[x]), points = std::abs(a.points[x] - b.points[x]);
    const double feature = std::sqrt(half_root * std::max(edges, points));
    out[x] = static_cast<float>(std::pow(color, 1.0 - feature));
  }
}

}  // namespace

std::vector<float> flip_map(const ColorImage& picture, const ColorImage& reference, const ThreadLimit& limit) {
  const FlipFilters filters = flip_filters();
  std::vector<float> map(picture.colors.size());
  const auto compare_rows = [&](std::size_t begin, std::size_t end) {
    BandFilter first(picture, filters, begin, end), second(reference, filters, begin, end);
    Perceived a(picture.width), b(picture.width);
    for (std::size_t y = begin; y < end; ++y) {
      first.perceive(y, a);
      second.perceive(y, b);
      compare_row(a, b, map.data() + y * picture.width);
    }
  };
  if (!parallel_batches(picture.height, kBandRows, limit, compare_rows)) map.clear();
  return map;
}

}  // namespace hiprt::tools
