#pragma once
/// The inverse transform, from an object to the scene that has an instance of it, in double: inverses, bounds, and how
/// much a transform magnifies rounding.

#include <hiprt_device/format/instance.h>
#include <hiprt_device/math/arithmetic.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace affine_detail {

/// A cofactor of a matrix of 3 x 3.
/// @tparam Number of its entries.
/// @param entry Number(unsigned row, unsigned column).
template <class Number, class Entry>
HIPRT_HD HIPRT_FORCE_INLINE double cofactor(Entry&& entry, unsigned r, unsigned c) {
  // Cyclic neighbours have the sign of the cofactor in them.
  const unsigned r1 = r == 2 ? 0 : r + 1, r2 = r == 0 ? 2 : r - 1, c1 = c == 2 ? 0 : c + 1, c2 = c == 0 ? 2 : c - 1;
  const double from = static_cast<double>(entry(r1, c2)), to = static_cast<double>(entry(r2, c1));
  const double minus = from * to;
  const double difference =
      fused_multiply_add(static_cast<double>(entry(r1, c1)), static_cast<double>(entry(r2, c2)), -minus);
  // Products of floats are exact. For doubles, Kahan's correction follows.
  if constexpr (sizeof(Number) == sizeof(float)) return difference;
  return difference + fused_multiply_add(-from, to, minus);
}

template <class Number, class Entry> HIPRT_HD HIPRT_FORCE_INLINE double determinant(Entry&& entry) {
  const auto at = [&](unsigned c) { return static_cast<double>(entry(0, c)); };
  return fused_multiply_add(
      at(0), cofactor<Number>(entry, 0, 0),
      fused_multiply_add(at(1), cofactor<Number>(entry, 0, 1), at(2) * cofactor<Number>(entry, 0, 2)));
}

}  // namespace affine_detail

/// The inverse of an instance's linear part.
struct LinearInverse {
  double row[3][3];
  double determinant;  ///< Of the linear part.

  HIPRT_HD explicit LinearInverse(const InstanceRecord& instance) : LinearInverse(instance.linear) {}

  template <class Number> HIPRT_HD explicit LinearInverse(const Number (&m)[3][3]) {
    const auto entry = [&](unsigned r, unsigned c) { return m[r][c]; };
    determinant = affine_detail::determinant<Number>(entry);
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) row[r][c] = affine_detail::cofactor<Number>(entry, c, r) / determinant;
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
  /// The largest sum of a row's magnitudes. It is the largest factor by which a vector's largest component can grow.
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

HIPRT_HD inline double larger(double a, double b) { return a < b ? b : a; }
HIPRT_HD inline double smaller(double a, double b) { return b < a ? b : a; }

/// The next float towards +infinity.
/// @param x not +infinity or NaN.
HIPRT_HD inline float next_above(float x) {
  if (x == 0.0f) return 0x1p-149f;
  const auto bits = std::bit_cast<std::uint32_t>(x);
  return std::bit_cast<float>(x > 0.0f ? bits + 1 : bits - 1);
}

/// The smallest float that is not below x, and the largest float that is not above x.
HIPRT_HD inline float round_up(double x) {
  const float nearest = nearest_float(x);
  return static_cast<double>(nearest) < x ? next_above(nearest) : nearest;
}
HIPRT_HD inline float round_down(double x) { return -round_up(-x); }

HIPRT_HD inline double norm(const float (&m)[3][3]) {
  double largest = 0.0;
  for (const auto& row : m) {
    double sum = 0.0;
    for (const float x : row) sum += LinearInverse::size(static_cast<double>(x));
    largest = larger(largest, sum);
  }
  return largest;
}

}  // namespace affine_detail

/// Bounds of an instance that stands still: transforms boxes of its object to the scene.
class StillInstanceBounds {
 public:
  /// @param record must live as long as this object.
  /// @param slack 1 for builders; less to check a box that another compiler's builder has made.
  HIPRT_HD explicit StillInstanceBounds(const InstanceRecord& record, double slack = 1.0)
      : record_(record), inverse_(record), slack_(slack) {
    const double magnification = inverse_.norm();
    // The error of the inverse is a few units of 2^-53 times the condition. Its products and sums add as much without
    // it.
    unit_ = 0x1p-48 * (1.0 + magnification * affine_detail::norm(record.linear)) * magnification;
  }

  /// A box that contains all points whose images in the object lie in @p box.
  HIPRT_HD Box bounds(const Box& box) const {
    using namespace affine_detail;
    double size = 0.0;
    for (unsigned c = 0; c < 3; ++c) size += larger(LinearInverse::size(box.min[c]), LinearInverse::size(box.max[c]));
    Box result;
    for (unsigned r = 0; r < 3; ++r) {
      const double origin = record_.translation[r];
      double low = origin, high = origin;
      for (unsigned c = 0; c < 3; ++c) {
        const double a = inverse_.row[r][c] * static_cast<double>(box.min[c]),
                     b = inverse_.row[r][c] * static_cast<double>(box.max[c]);
        low += smaller(a, b);
        high += larger(a, b);
      }
      const double pad = slack_ * (unit_ * size + 0x1p-50 * LinearInverse::size(origin));
      result.min[r] = round_down(low - pad);
      result.max[r] = round_up(high + pad);
    }
    return result;
  }

 private:
  const InstanceRecord& record_;
  LinearInverse inverse_;
  double slack_, unit_;
};

/// The longest and the shortest image of a unit vector.
///
/// The relative error of the shorter one is about 2^-50 times the condition number of the matrix with columns of
/// length 1. Down to 2^-20 of the longer it is accurate to 2^-30.
struct Stretches {
  double longest, shortest;

  HIPRT_HD explicit Stretches(const double (&m)[3][3]) {
    using affine_detail::larger, affine_detail::smaller;
    double scale = 0.0;
    for (const auto& row : m)
      for (const double x : row) scale = larger(scale, LinearInverse::size(x));
    double column[3][3];
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) column[c][r] = m[r][c] / scale;
    // Turns columns until they are at right angles. Their lengths are then the singular values (Hestenes 1958).
    bool turned = true;
    for (unsigned sweep = 0; sweep < 16 && turned; ++sweep) {
      turned = turn(column[0], column[1]);
      turned = turn(column[0], column[2]) || turned;
      turned = turn(column[1], column[2]) || turned;
    }
    const double x = dot(column[0], column[0]), y = dot(column[1], column[1]), z = dot(column[2], column[2]);
    longest = scale * square_root(larger(larger(x, y), z));
    shortest = scale * square_root(smaller(smaller(x, y), z));
  }

 private:
  // Fused, so that the bits are the same everywhere.
  HIPRT_HD static double dot(const double (&a)[3], const double (&b)[3]) {
    return fused_multiply_add(a[0], b[0], fused_multiply_add(a[1], b[1], a[2] * b[2]));
  }
  /// Turns two columns to a right angle, without trigonometry (Rutishauser 1966).
  /// @return whether they were not accurate already.
  HIPRT_HD static bool turn(double (&p)[3], double (&q)[3]) {
    const double pp = dot(p, p), qq = dot(q, q), pq = dot(p, q);
    if (!(LinearInverse::size(pq) > 0x1p-50 * square_root(pp * qq))) return false;
    const double cotangent = (qq - pp) / (2.0 * pq);  // Cotangent of twice the angle.
    const double tangent =
        (cotangent < 0.0 ? -1.0 : 1.0) /
        (LinearInverse::size(cotangent) + square_root(fused_multiply_add(cotangent, cotangent, 1.0)));
    const double cosine = 1.0 / square_root(fused_multiply_add(tangent, tangent, 1.0)), sine = tangent * cosine;
    for (unsigned k = 0; k < 3; ++k) {
      const double x = p[k], y = q[k];
      p[k] = fused_multiply_add(cosine, x, -(sine * y));
      q[k] = fused_multiply_add(sine, x, cosine * y);
    }
    return true;
  }
};

/// The condition number of the linear part in the Euclidean norm: the ratio of the longest to the shortest image of a
/// unit vector. 1 for rotations, mirrors and uniform scales.
HIPRT_HD inline double condition_of(const InstanceRecord& instance) {
  double m[3][3];
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 3; ++c) m[r][c] = instance.linear[r][c];
  const Stretches stretches(m);
  if (stretches.shortest > 0x1p-20 * stretches.longest) return stretches.longest / stretches.shortest;
  // Otherwise use the norms, which are larger.
  return 3.0 * LinearInverse(instance).norm() * affine_detail::norm(instance.linear);
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
