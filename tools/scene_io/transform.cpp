#include <tools/scene_io/transform.h>

#include <tools/base/errors.h>

#include <hiprt_build/instances/double_matrix.h>

#include <algorithm>
#include <cmath>

namespace hiprt::tools {

build::Position Transform::operator()(const build::Position& p) const {
  build::Position result;
  for (std::size_t row = 0; row < 3; ++row)
    result[row] = static_cast<float>(m[row][0] * p[0] + m[row][1] * p[1] + m[row][2] * p[2] + m[row][3]);
  return result;
}

Transform Transform::operator*(const Transform& inner) const { return {build::product(m, inner.m)}; }

bool Transform::mirrors() const {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
             m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]) <
         0;
}

NormalTransform::NormalTransform(const Transform& transform) {
  double largest = 0;
  for (const auto& row : transform.m)
    for (std::size_t column = 0; column < 3; ++column) largest = std::max(largest, std::abs(row[column]));
  if (!(largest > 0 && std::isfinite(largest))) return;
  // The transposed inverse is the matrix of cofactors divided by the determinant. Only the determinant's sign matters
  // here.
  const double sign = transform.mirrors() ? -1 : 1;
  const auto at = [&](std::size_t row, std::size_t column) { return transform.m[row % 3][column % 3] / largest; };
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column)
      m_[row][column] = sign * (at(row + 1, column + 1) * at(row + 2, column + 2) -
                                at(row + 1, column + 2) * at(row + 2, column + 1));
}

std::array<float, 3> NormalTransform::operator()(const std::array<float, 3>& normal) const {
  std::array<double, 3> n{};
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column) n[row] += m_[row][column] * static_cast<double>(normal[column]);
  const double length = std::hypot(n[0], n[1], n[2]);
  if (!(length > 0 && std::isfinite(length))) return {0, 0, 0};
  return {static_cast<float>(n[0] / length), static_cast<float>(n[1] / length), static_cast<float>(n[2] / length)};
}

Transform to_double(const build::Affine& affine) { return {build::to_double(affine)}; }

build::Affine to_float(const Transform& transform) { return build::to_float(transform.m); }

build::Result<Transform> transform_of(const Placement& placement) {
  constexpr double kTolerance = 1e-3;
  std::array<double, 4> q = placement.rotation;
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::abs(length - 1) <= kTolerance))
    return invalid_input("rotation has the length " + std::to_string(length) +
                         ", which may differ from 1 by 0.001 at most");
  for (double& part : q) part /= length;
  const auto [x, y, z, w] = q;
  const std::array<std::array<double, 3>, 3> r{{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                                                {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                                                {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
  Transform result;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) result.m[row][column] = r[row][column] * placement.scale[column];
    result.m[row][3] = placement.translation[row];
  }
  return result;
}

}  // namespace hiprt::tools
