#pragma once
/// LDR-FLIP step by step as in the paper, in double, with unseparated filters. tools/render/image/flip.h must agree
/// with it. Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", 2020.

#include <tools/render/image/color_image.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

namespace hiprt::test {

using Triple = std::array<double, 3>;

/// Solves a 3 x 3 system by Cramer's rule; the columns are those of the matrix.
inline Triple solve(const std::array<Triple, 3>& columns, const Triple& right) {
  const auto determinant = [](const Triple& a, const Triple& b, const Triple& c) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  };
  const double all = determinant(columns[0], columns[1], columns[2]);
  return {determinant(right, columns[1], columns[2]) / all, determinant(columns[0], right, columns[2]) / all,
          determinant(columns[0], columns[1], right) / all};
}

/// The XYZ of sRGB's primaries and white, from their chromaticities (IEC 61966-2-1).
struct Primaries {
  std::array<Triple, 3> columns;
  Triple white;

  Primaries() {
    const auto xyz = [](double x, double y) { return Triple{x / y, 1.0, (1.0 - x - y) / y}; };
    columns = {xyz(0.64, 0.33), xyz(0.30, 0.60), xyz(0.15, 0.06)};
    white = xyz(0.3127, 0.3290);
    const Triple strengths = solve(columns, white);
    for (std::size_t primary = 0; primary < 3; ++primary)
      for (double& value : columns[primary]) value *= strengths[primary];
  }
  Triple xyz_of(const Triple& rgb) const {
    Triple xyz{};
    for (std::size_t primary = 0; primary < 3; ++primary)
      for (std::size_t i = 0; i < 3; ++i) xyz[i] += columns[primary][i] * rgb[primary];
    return xyz;
  }
  Triple rgb_of(const Triple& xyz) const { return solve(columns, xyz); }
};

inline const Primaries kPrimaries;

inline Triple ycxcz_of(const Triple& rgb) {
  const Triple xyz = kPrimaries.xyz_of(rgb), &white = kPrimaries.white;
  const double x = xyz[0] / white[0], y = xyz[1] / white[1], z = xyz[2] / white[2];
  return {116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)};
}

inline Triple rgb_of_ycxcz(const Triple& opponent) {
  const Triple& white = kPrimaries.white;
  const double y = (opponent[0] + 16.0) / 116.0;
  return kPrimaries.rgb_of({(y + opponent[1] / 500.0) * white[0], y * white[1], (y - opponent[2] / 200.0) * white[2]});
}

/// L*a*b*, then the Hunt effect.
inline Triple hunt_lab_of(const Triple& rgb) {
  const auto f = [](double t) {
    const double delta = 6.0 / 29.0;
    return t > std::pow(delta, 3) ? std::cbrt(t) : t / (3.0 * delta * delta) + 4.0 / 29.0;
  };
  const Triple xyz = kPrimaries.xyz_of(rgb), &white = kPrimaries.white;
  const double fx = f(xyz[0] / white[0]), fy = f(xyz[1] / white[1]), fz = f(xyz[2] / white[2]);
  const double l = 116.0 * fy - 16.0;
  return {l, 0.01 * l * 500.0 * (fx - fy), 0.01 * l * 200.0 * (fy - fz)};
}

inline double hyab_of(const Triple& a, const Triple& b) {
  return std::abs(a[0] - b[0]) + std::sqrt(std::pow(a[1] - b[1], 2) + std::pow(a[2] - b[2], 2));
}

/// Of HyAB distances to the power of 0.7: 0 to 0.95 below 0.4 of the largest, 0.95 to 1 above.
inline double redistributed(double error) {
  const double largest = std::pow(hyab_of(hunt_lab_of({0, 1, 0}), hunt_lab_of({0, 0, 1})), 0.7);
  const double bend = 0.4 * largest;
  return error < bend ? 0.95 / bend * error : 0.95 + (error - bend) / (largest - bend) * 0.05;
}

/// A square filter in the plane.
struct PlaneFilter {
  int radius;
  std::vector<double> weights;  ///< Row by row.

  PlaneFilter(int filter_radius, const std::function<double(double, double)>& value) : radius(filter_radius) {
    for (int y = -radius; y <= radius; ++y)
      for (int x = -radius; x <= radius; ++x) weights.push_back(value(x, y));
  }
  /// Positive weights then sum to 1, negative ones to -1.
  PlaneFilter normalized() const {
    double positive = 0.0, negative = 0.0;
    for (const double w : weights) (w > 0 ? positive : negative) += std::abs(w);
    PlaneFilter result = *this;
    for (double& w : result.weights) w /= w > 0 ? positive : negative;
    return result;
  }
};

/// The pictures' pixels by row and column; beyond the borders those at the borders.
class SlowPicture {
 public:
  explicit SlowPicture(const tools::ColorImage& image) : width_(image.width), height_(image.height) {
    for (const Vec3& color : image.colors) pixels_.push_back(ycxcz_of({color.x, color.y, color.z}));
  }
  const Triple& at(int x, int y) const {
    const int column = std::clamp(x, 0, static_cast<int>(width_) - 1);
    const int row = std::clamp(y, 0, static_cast<int>(height_) - 1);
    return pixels_[static_cast<std::size_t>(row) * width_ + static_cast<std::size_t>(column)];
  }
  double filtered(int x, int y, const PlaneFilter& filter, const std::function<double(const Triple&)>& value) const {
    double sum = 0.0;
    std::size_t i = 0;
    for (int dy = -filter.radius; dy <= filter.radius; ++dy)
      for (int dx = -filter.radius; dx <= filter.radius; ++dx) sum += filter.weights[i++] * value(at(x + dx, y + dy));
    return sum;
  }

 private:
  std::size_t width_, height_;
  std::vector<Triple> pixels_;
};

class SlowFlip {
 public:
  explicit SlowFlip(double pixels_per_degree = 67.0) : ppd_(pixels_per_degree) {
    sensitivity_ = {sensitivity(1.0, 0.0047, 0.0, 1e-5), sensitivity(1.0, 0.0053, 0.0, 1e-5),
                    sensitivity(34.1, 0.04, 13.5, 0.025)};
    const double deviation = 0.5 * 0.082 * ppd_;
    const auto gauss = [=](double x, double y) { return std::exp(-(x * x + y * y) / (2 * deviation * deviation)); };
    const auto first = [=](double along, double g) { return -along * g; };
    const auto second = [=](double along, double g) { return (along * along / (deviation * deviation) - 1) * g; };
    const int radius = static_cast<int>(std::ceil(3 * deviation));
    edges_ = {PlaneFilter(radius, [=](double x, double y) { return first(x, gauss(x, y)); }).normalized(),
              PlaneFilter(radius, [=](double x, double y) { return first(y, gauss(x, y)); }).normalized()};
    points_ = {PlaneFilter(radius, [=](double x, double y) { return second(x, gauss(x, y)); }).normalized(),
               PlaneFilter(radius, [=](double x, double y) { return second(y, gauss(x, y)); }).normalized()};
  }

  std::vector<double> map(const tools::ColorImage& picture, const tools::ColorImage& reference) const {
    const SlowPicture a(picture), b(reference);
    std::vector<double> result;
    for (int y = 0; y < static_cast<int>(picture.height); ++y)
      for (int x = 0; x < static_cast<int>(picture.width); ++x) result.push_back(at(a, b, x, y));
    return result;
  }

 private:
  PlaneFilter sensitivity(double a1, double b1, double a2, double b2) const {
    const double pi = std::numbers::pi, ppd = ppd_;
    const int radius = static_cast<int>(std::ceil(3 * std::sqrt(0.04 / (2 * pi * pi)) * ppd));
    return PlaneFilter(radius,
                       [=](double x, double y) {
                         const double square = (x * x + y * y) / (ppd * ppd);
                         return a1 * std::sqrt(pi / b1) * std::exp(-pi * pi * square / b1) +
                                a2 * std::sqrt(pi / b2) * std::exp(-pi * pi * square / b2);
                       })
        .normalized();
  }

  Triple lab(const SlowPicture& picture, int x, int y) const {
    Triple filtered{};
    for (std::size_t c = 0; c < 3; ++c)
      filtered[c] = picture.filtered(x, y, sensitivity_[c], [c](const Triple& pixel) { return pixel[c]; });
    Triple rgb = rgb_of_ycxcz(filtered);
    for (double& value : rgb) value = std::clamp(value, 0.0, 1.0);
    return hunt_lab_of(rgb);
  }
  static double strength(const SlowPicture& picture, int x, int y, const std::vector<PlaneFilter>& filters) {
    const auto gray = [](const Triple& pixel) { return (pixel[0] + 16.0) / 116.0; };
    return std::hypot(picture.filtered(x, y, filters[0], gray), picture.filtered(x, y, filters[1], gray));
  }
  double at(const SlowPicture& a, const SlowPicture& b, int x, int y) const {
    const double color = redistributed(std::pow(hyab_of(lab(a, x, y), lab(b, x, y)), 0.7));
    const double edge = std::abs(strength(a, x, y, edges_) - strength(b, x, y, edges_));
    const double point = std::abs(strength(a, x, y, points_) - strength(b, x, y, points_));
    const double feature = std::sqrt(std::max(edge, point) / std::sqrt(2.0));
    return std::pow(color, 1.0 - feature);
  }

  double ppd_;
  std::vector<PlaneFilter> sensitivity_, edges_, points_;
};

}  // namespace hiprt::test
