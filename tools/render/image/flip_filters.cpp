#include <tools/render/image/flip_filters.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hiprt::tools {
namespace {

using std::numbers::pi;

/// a exp(-b f^2) of the frequency f in cycles per degree; in space a sqrt(pi / b) exp(-pi^2 r^2 / b), r in degrees.
struct Sensitivity {
  double a, b;
};

/// Table 1 of the paper.
constexpr Sensitivity kAchromatic{1.0, 0.0047}, kRedGreen{1.0, 0.0053}, kBlueYellowFirst{34.1, 0.04},
    kBlueYellowSecond{13.5, 0.025};

/// Degrees: the width of a feature's edge.
constexpr double kFeatureWidth = 0.082;

/// Both kinds of filters end at three standard deviations, those of sensitivity at three of the largest.
std::size_t radius_of(double deviation) { return static_cast<std::size_t>(std::ceil(3.0 * deviation)); }

std::vector<double> sampled(std::size_t radius, double per_square) {
  std::vector<double> values(2 * radius + 1);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double x = static_cast<double>(i) - static_cast<double>(radius);
    values[i] = std::exp(-per_square * x * x);
  }
  return values;
}

double sum(const std::vector<double>& values) {
  double total = 0.0;
  for (const double value : values) total += value;
  return total;
}

Kernel scaled(const std::vector<double>& values, double factor) {
  Kernel kernel(values.size());
  std::transform(values.begin(), values.end(), kernel.begin(), [&](double v) { return v * factor; });
  return kernel;
}

std::vector<double> sampled(std::size_t radius, const Sensitivity& part) {
  return sampled(radius, pi * pi / (part.b * kPixelsPerDegree * kPixelsPerDegree));
}

/// The sum over the plane, whose filter is the product of one in x and the same in y.
double volume(std::size_t radius, const Sensitivity& part) {
  const double line = sum(sampled(radius, part));
  return part.a * std::sqrt(pi / part.b) * line * line;
}

Kernel sensitivity_kernel(std::size_t radius, const Sensitivity& part, double all) {
  return scaled(sampled(radius, part), std::sqrt(part.a * std::sqrt(pi / part.b) / all));
}

/// Positive values are made to sum to 1, negative ones to -1.
Kernel balanced(const std::vector<double>& values) {
  double positive = 0.0, negative = 0.0;
  for (const double value : values) (value > 0.0 ? positive : negative) += std::abs(value);
  Kernel kernel(values.size());
  std::transform(values.begin(), values.end(), kernel.begin(), [&](double v) {
    return v / (v > 0.0 ? positive : negative > 0.0 ? negative : 1.0);
  });
  return kernel;
}

void add_sensitivity(FlipFilters& filters) {
  const double widest = std::sqrt(kBlueYellowFirst.b / (2.0 * pi * pi)) * kPixelsPerDegree;
  const std::size_t radius = filters.sensitivity_radius = radius_of(widest);
  filters.achromatic = sensitivity_kernel(radius, kAchromatic, volume(radius, kAchromatic));
  filters.red_green = sensitivity_kernel(radius, kRedGreen, volume(radius, kRedGreen));
  const double both = volume(radius, kBlueYellowFirst) + volume(radius, kBlueYellowSecond);
  filters.blue_yellow_first = sensitivity_kernel(radius, kBlueYellowFirst, both);
  filters.blue_yellow_second = sensitivity_kernel(radius, kBlueYellowSecond, both);
}

void add_features(FlipFilters& filters) {
  const double deviation = 0.5 * kFeatureWidth * kPixelsPerDegree;
  const std::size_t radius = filters.feature_radius = radius_of(deviation);
  const std::vector<double> gauss = sampled(radius, 0.5 / (deviation * deviation));
  std::vector<double> first(gauss), second(gauss);
  for (std::size_t i = 0; i < gauss.size(); ++i) {
    const double x = static_cast<double>(i) - static_cast<double>(radius);
    first[i] *= -x;
    second[i] *= x * x / (deviation * deviation) - 1.0;
  }
  filters.smooth = balanced(gauss);
  filters.slope = balanced(first);
  filters.curvature = balanced(second);
}

}  // namespace

FlipFilters flip_filters() {
  FlipFilters filters{};
  add_sensitivity(filters);
  add_features(filters);
  return filters;
}

void weighted_sum(const double* first, std::size_t stride, const Kernel& weights, double* out, std::size_t width) {
  std::fill(out, out + width, 0.0);
  for (std::size_t k = 0; k < weights.size(); ++k) {
    const double weight = weights[k];
    const double* const in = first + k * stride;
    for (std::size_t x = 0; x < width; ++x) out[x] += weight * in[x];
  }
}

}  // namespace hiprt::tools
