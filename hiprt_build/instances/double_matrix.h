#pragma once
/// Affine matrices in double: products that are rounded to float once, at the end. Internal.

#include <hiprt_build/instances.h>
#include <hiprt_device/math/arithmetic.h>

#include <array>

namespace hiprt::build {

/// Three rows of four, without the last row (0, 0, 0, 1).
using DoubleMatrix = std::array<std::array<double, 4>, 3>;

inline DoubleMatrix to_double(const Affine& affine) {
  DoubleMatrix rows{};
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 4; ++c) rows[r][c] = static_cast<double>(affine.row[r][c]);
  return rows;
}

/// Rounds every number. Numbers that are too large become infinite.
inline Affine to_float(const DoubleMatrix& rows) {
  Affine result;
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 4; ++c) result.row[r][c] = nearest_float(rows[r][c]);
  return result;
}

/// First @p inner, then @p outer.
inline DoubleMatrix product(const DoubleMatrix& outer, const DoubleMatrix& inner) {
  DoubleMatrix result{};
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 4; ++c) {
      double sum = c == 3 ? outer[r][3] : 0.0;
      for (unsigned k = 3; k-- > 0;) sum = fused_multiply_add(outer[r][k], inner[k][c], sum);
      result[r][c] = sum;
    }
  return result;
}

}  // namespace hiprt::build
