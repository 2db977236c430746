#pragma once
/// Exact arithmetic on floats, for hosts and devices: signs of sums of products.
///
/// Every finite float is allowed, including subnormal ones; nothing overflows or underflows. The code is slow, and
/// meant for the cases that a filter leaves undecided. It is small and works in memory, so that it costs the code
/// around it no registers.
///
/// A product of two floats is a double; a product of three is two doubles. A sum of doubles is an expansion: a list of
/// doubles that do not overlap, in the order of magnitude. The method is grow-expansion with zero elimination
/// (Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric predicates", 1997).

#include <hiprt_device/math/arithmetic.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// a * b, rounded before anything is added to it, whether or not a compiler contracts operations.
HIPRT_HD HIPRT_FORCE_INLINE double rounded_product(double a, double b) { return fused_multiply_add(a, b, 0.0); }

/// a + b = sum + rest exactly (Knuth). @pre neither is a product that could be contracted with the sum.
struct TwoSum {
  double sum, rest;
  HIPRT_HD HIPRT_FORCE_INLINE TwoSum(double a, double b) : sum(a + b) {
    const double taken = sum - a;
    rest = (a - (sum - taken)) + (b - taken);
  }
};

/// The exact sum of at most kMost doubles, each 0 or between 2^-1000 and 2^1000.
template <unsigned kMost> class ExactSum {
 public:
  HIPRT_HD HIPRT_FORCE_INLINE void add(double value) {
    unsigned count = 0;
    HIPRT_NO_UNROLL
    for (unsigned i = 0; i < count_; ++i) {
      const TwoSum both(value, part_[i]);
      value = both.sum;
      if (both.rest != 0.0) part_[count++] = both.rest;
    }
    if (value != 0.0) part_[count++] = value;
    count_ = count;
  }
  /// det[a, b, c]: twelve doubles.
  HIPRT_HD HIPRT_FORCE_INLINE void add_determinant(const float* a, const float* b, const float* c) {
    HIPRT_NO_UNROLL
    for (unsigned term = 0; term < 12; ++term) {
      const unsigned i = term >> 2, after = i == 2 ? 0 : i + 1, before = i == 0 ? 2 : i - 1;
      const bool negative = (term & 2u) != 0;
      const double pair = static_cast<double>(a[i]) * static_cast<double>(b[negative ? before : after]);
      const double two = negative ? -pair : pair, third = c[negative ? after : before],
                   product = rounded_product(two, third);
      add((term & 1u) == 0 ? product : fused_multiply_add(two, third, -product));
    }
  }

  /// -1, 0 or 1.
  HIPRT_HD HIPRT_FORCE_INLINE int sign() const { return count_ == 0 ? 0 : part_[count_ - 1] > 0.0 ? 1 : -1; }
  /// The rounded sum; its relative error is at most 2^-51.
  HIPRT_HD HIPRT_FORCE_INLINE double value() const {
    double sum = 0.0;
    HIPRT_NO_UNROLL
    for (unsigned i = 0; i < count_; ++i) sum += part_[i];
    return sum;
  }

 private:
  double part_[kMost];  ///< Increasing in magnitude; none is 0.
  unsigned count_ = 0;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
