#pragma once
/// Colour spaces of FLIP (tools/render/image/flip.h).

#include <hiprt_device/math/vec.h>

#include <array>
#include <cmath>
#include <cstddef>

namespace hiprt::tools {

using ColorMatrix = std::array<std::array<double, 3>, 3>;

/// XYZ over that of the white D65, of linear sRGB (IEC 61966-2-1): every row sums to 1.
constexpr ColorMatrix xyz_of_rgb() {
  ColorMatrix matrix{{{0.41239079926595, 0.35758433938387, 0.18048078840183},
                      {0.21263900587151, 0.71516867876775, 0.07219231536073},
                      {0.01933081871559, 0.11919477979462, 0.95053215224966}}};
  for (auto& row : matrix) {
    const double white = row[0] + row[1] + row[2];
    for (double& entry : row) entry /= white;
  }
  return matrix;
}

constexpr ColorMatrix inverse(const ColorMatrix& m) {
  const auto minor = [&](std::size_t row, std::size_t column) {
    const std::size_t r1 = (row + 1) % 3, r2 = (row + 2) % 3, c1 = (column + 1) % 3, c2 = (column + 2) % 3;
    return m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
  };
  const double determinant = m[0][0] * minor(0, 0) + m[0][1] * minor(0, 1) + m[0][2] * minor(0, 2);
  ColorMatrix result{};
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column) result[row][column] = minor(column, row) / determinant;
  return result;
}

inline constexpr ColorMatrix kXyzOfRgb = xyz_of_rgb();
inline constexpr ColorMatrix kRgbOfXyz = inverse(kXyzOfRgb);

/// Three values of any of the spaces below. In double precision: FLIP takes roots of differences.
using Color = std::array<double, 3>;

inline Color times(const ColorMatrix& m, const Color& v) {
  return {m[0][0] * v[0] + m[0][1] * v[1] + m[0][2] * v[2], m[1][0] * v[0] + m[1][1] * v[1] + m[1][2] * v[2],
          m[2][0] * v[0] + m[2][1] * v[1] + m[2][2] * v[2]};
}

/// y, x - y and y - z of x, y, z over those of the white. The opponent space YCxCz of the paper is 116 y - 16,
/// 500 (x - y), 200 (y - z): filters whose weights sum to 1 give the same without the factors.
inline Color opponent_from_linear(const Vec3& rgb) {
  const auto [x, y, z] = times(kXyzOfRgb, {rgb.x, rgb.y, rgb.z});
  return {y, x - y, y - z};
}
inline Color linear_from_opponent(const Color& v) { return times(kRgbOfXyz, {v[0] + v[1], v[0], v[0] - v[2]}); }

/// CIE L*a*b* (1976), a* and b* times 0.01 L* for the Hunt effect: colours differ less where it is dark.
/// @param rgb linear, 0 to 1.
inline Color hunt_lab_from_linear(const Color& rgb) {
  constexpr double kDelta = 6.0 / 29.0;
  const auto curve = [](double t) {
    return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3.0 * kDelta * kDelta) + 4.0 / 29.0;
  };
  const auto [x, y, z] = times(kXyzOfRgb, rgb);
  const double fx = curve(x), fy = curve(y), fz = curve(z), lightness = 116.0 * fy - 16.0;
  return {lightness, 0.01 * lightness * 500.0 * (fx - fy), 0.01 * lightness * 200.0 * (fy - fz)};
}

/// Abasi, Tehran and Fairchild, "Distance metrics for very large color differences", 2020.
inline double hyab_distance(const Color& a, const Color& b) {
  const double along_a = a[1] - b[1], along_b = a[2] - b[2];
  return std::abs(a[0] - b[0]) + std::sqrt(along_a * along_a + along_b * along_b);
}

}  // namespace hiprt::tools
