#pragma once
/// The way back from an object to the scene that has an instance of it, in double: inverses, bounds and how much a
/// transform magnifies rounding.

#include <hiprt_device/format/arithmetic.h>
#include <hiprt_device/format/instance.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The inverse of an instance's linear part.
struct LinearInverse {
  double row[3][3];
  double determinant;  ///< Of the linear part.

  HIPRT_HD explicit LinearInverse(const InstanceRecord& instance) : LinearInverse(instance.linear) {}

  template <class Number> HIPRT_HD explicit LinearInverse(const Number (&m)[3][3]) {
    // Cyclic neighbours have the sign of the cofactor in them.
    const auto cofactor = [&](unsigned r, unsigned c) {
      const unsigned r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
      const double minus = static_cast<double>(m[r1][c2]) * static_cast<double>(m[r2][c1]);
      const double difference =
          fused_multiply_add(static_cast<double>(m[r1][c1]), static_cast<double>(m[r2][c2]), -minus);
      // The products of floats are exact; of doubles, what was lost comes after (Kahan).
      if constexpr (sizeof(Number) == sizeof(float)) return difference;
      return difference + fused_multiply_add(-static_cast<double>(m[r1][c2]), static_cast<double>(m[r2][c1]), minus);
    };
    determinant = fused_multiply_add(static_cast<double>(m[0][0]), cofactor(0, 0),
                                     fused_multiply_add(static_cast<double>(m[0][1]), cofactor(0, 1),
                                                        static_cast<double>(m[0][2]) * cofactor(0, 2)));
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) row[r][c] = cofactor(c, r) / determinant;
  }

  HIPRT_HD bool exists() const {
    double zero = 0.0;
    for (unsigned k = 0; k < 3; ++k) zero += row[k][0] * 0.0 + row[k][1] * 0.0 + row[k][2] * 0.0;
    return zero == 0.0;
  }
  /// Row k times a vector.
  HIPRT_HD double times(unsigned k, double x, double y, double z) const {
    return fused_multiply_add(row[k][0], x, fused_multiply_add(row[k][1], y, row[k][2] * z));
  }
  /// Of |row|, the largest sum: how much longer the largest component of a vector becomes at most.
  HIPRT_HD double norm() const {
    double largest = 0.0;
    for (unsigned k = 0; k < 3; ++k) {
      const double sum = size(row[k][0]) + size(row[k][1]) + size(row[k][2]);
      largest = sum > largest ? sum : largest;
    }
    return largest;
  }
  HIPRT_HD static double size(double x) { return x < 0.0 ? -x : x; }
};

namespace affine_detail {

/// The nearest floats that are no larger, and no smaller.
inline float round_down(double x) {
  const auto nearest = static_cast<float>(x);
  return static_cast<double>(nearest) <= x ? nearest : std::nextafter(nearest, -std::numeric_limits<float>::infinity());
}
inline float round_up(double x) {
  const auto nearest = static_cast<float>(x);
  return static_cast<double>(nearest) >= x ? nearest : std::nextafter(nearest, std::numeric_limits<float>::infinity());
}

inline double norm(const float (&m)[3][3]) {
  double largest = 0.0;
  for (const auto& row : m)
    largest = std::max(largest, std::fabs(double{row[0]}) + std::fabs(double{row[1]}) + std::fabs(double{row[2]}));
  return largest;
}

}  // namespace affine_detail

/// A box that holds all points whose images in the object lie in @p box: for the host.
/// @param slack 1 for builders; less for who checks a box that another compiler's builder has made.
inline Box bounds_in_scene(const InstanceRecord& instance, const LinearInverse& inverse, const Box& box,
                           double slack = 1.0) {
  using namespace affine_detail;
  const double magnification = inverse.norm();
  // The inverse is off by a few units of 2^-53, times the condition; its products and sums by as much without it.
  const double unit = 0x1p-48 * (1.0 + magnification * norm(instance.linear)) * magnification;
  double size = 0.0;
  for (unsigned c = 0; c < 3; ++c) size += std::max(std::fabs(double{box.min[c]}), std::fabs(double{box.max[c]}));
  Box result;
  for (unsigned r = 0; r < 3; ++r) {
    double low = instance.translation[r], high = low;
    for (unsigned c = 0; c < 3; ++c) {
      const double a = inverse.row[r][c] * double{box.min[c]}, b = inverse.row[r][c] * double{box.max[c]};
      low += std::min(a, b);
      high += std::max(a, b);
    }
    const double pad = slack * (unit * size + 0x1p-50 * std::fabs(double{instance.translation[r]}));
    result.min[r] = round_down(low - pad);
    result.max[r] = round_up(high + pad);
  }
  return result;
}

/// The longest and the shortest image of a unit vector; the shorter one is good down to 2^-20 of the longer. For the
/// host.
struct Stretches {
  double longest, shortest;

  explicit Stretches(const double (&m)[3][3]) {
    double scale = 0.0;
    for (const auto& row : m)
      for (const double x : row) scale = std::max(scale, std::fabs(x));
    // The eigenvalues of its transpose times itself, by Jacobi rotations.
    double a[3][3];
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) {
        a[r][c] = 0.0;
        for (unsigned k = 0; k < 3; ++k) a[r][c] += (m[k][r] / scale) * (m[k][c] / scale);
      }
    for (unsigned sweep = 0; sweep < 16; ++sweep)
      for (unsigned p = 0; p < 2; ++p)
        for (unsigned q = p + 1; q < 3; ++q) {
          if (a[p][q] == 0.0) continue;
          const double theta = 0.5 * std::atan2(2.0 * a[p][q], a[q][q] - a[p][p]);
          const double cosine = std::cos(theta), sine = std::sin(theta);
          for (unsigned k = 0; k < 3; ++k) {
            const double kp = a[k][p], kq = a[k][q];
            a[k][p] = cosine * kp - sine * kq;
            a[k][q] = sine * kp + cosine * kq;
          }
          for (unsigned k = 0; k < 3; ++k) {
            const double pk = a[p][k], qk = a[q][k];
            a[p][k] = cosine * pk - sine * qk;
            a[q][k] = sine * pk + cosine * qk;
          }
        }
    longest = scale * std::sqrt(std::max({a[0][0], a[1][1], a[2][2], 0.0}));
    shortest = scale * std::sqrt(std::max(0.0, std::min({a[0][0], a[1][1], a[2][2]})));
  }
};

/// The condition number of the linear part in the Euclidean norm: the ratio of the longest to the shortest image of a
/// unit vector. 1 for rotations, mirrors and uniform scales. For the host.
inline double condition_of(const InstanceRecord& instance) {
  double m[3][3];
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 3; ++c) m[r][c] = instance.linear[r][c];
  const Stretches stretches(m);
  if (stretches.shortest > 0x1p-20 * stretches.longest) return stretches.longest / stretches.shortest;
  // Then the norms, which are larger.
  return 3.0 * LinearInverse(instance).norm() * affine_detail::norm(instance.linear);
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
