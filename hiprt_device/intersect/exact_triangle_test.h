#pragma once
/// Triangle tests that decide as if computed with real numbers.

#include <hiprt_device/intersect/watertight.h>
#include <hiprt_device/math/exact.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace exact_detail {

/// A line and a triangle as numbered vectors, with others to compute with.
struct LineAndTriangle {
  static constexpr unsigned kOrigin = 0, kDirection = 1, kCorner = 2, kAxis = 5, kMinusOrigin = 8, kZero = 9;
  float vector[10][3];
};

/// The determinant of three differences of vectors, in twice the precision of double.
///
/// The precision holds if the differences are exact in double. They are, unless one vector is 2^29 times the other.
struct RoundedDeterminant {
  double value = 0.0,
         error = 0.0;  ///< The exact determinant is within error of value, except for value's last rounding.

  /// The determinant of the vectors minuend[i] - subtrahend[i], given by their numbers.
  HIPRT_HD HIPRT_FORCE_INLINE RoundedDeterminant(const LineAndTriangle& of, const unsigned (&minuend)[3],
                                                 const unsigned (&subtrahend)[3]) {
    double row[3][3];
    bool exact = true;
    HIPRT_NO_UNROLL
    for (unsigned i = 0; i < 3; ++i) {
      HIPRT_NO_UNROLL
      for (unsigned k = 0; k < 3; ++k) {
        const TwoSum difference(of.vector[minuend[i]][k], -static_cast<double>(of.vector[subtrahend[i]][k]));
        row[i][k] = difference.sum;
        exact = exact && difference.rest == 0.0;
      }
    }
    double low = 0.0, size = 0.0;
    HIPRT_NO_UNROLL
    for (unsigned term = 0; term < 6; ++term) {
      const unsigned i = term >> 1, after = i == 2 ? 0 : i + 1, before = i == 0 ? 2 : i - 1;
      const bool negative = (term & 1u) != 0;
      const double x = negative ? -row[0][i] : row[0][i], y = row[1][negative ? before : after],
                   z = row[2][negative ? after : before];
      const double pair = y * z, product = rounded_product(x, pair);
      const TwoSum sum(value, product);
      value = sum.sum;
      low += fused_multiply_add(x, fused_multiply_add(y, z, -pair), sum.rest + fused_multiply_add(x, pair, -product));
      size += product < 0.0 ? -product : product;
    }
    value += low;
    error = (exact ? 0x1p-96 : 0x1p-49) * size;
  }
};

enum class InDouble { kPasses, kMisses, kUndecided };

/// Whether and where a line passes through a triangle, in double. Sets result if it passes.
///
/// The result is undecided if one of these is not certain:
/// - the sign of an edge function,
/// - t within 2^-26 of itself, unless it is negative,
/// - u and v within 2^-23 of 1.
///
/// @param uncertainty of the triangle's edge functions as Reference computes them. The edge functions in double have
/// an error of less than 2^-26 of it, with the direction's last component as the scale instead of 1.
HIPRT_HD HIPRT_FORCE_INLINE InDouble find_in_double(const LineAndTriangle& of, float uncertainty, Candidate& result) {
  const double d[3] = {of.vector[1][0], of.vector[1][1], of.vector[1][2]};
  double x[3], y[3], z[3];
  const auto shear = [&](unsigned i) HIPRT_FORCE_INLINE_LAMBDA {
    const auto from = [&](unsigned axis) HIPRT_FORCE_INLINE_LAMBDA {
      return static_cast<double>(of.vector[2 + i][axis]) - static_cast<double>(of.vector[0][axis]);
    };
    z[i] = from(2);
    x[i] = fused_multiply_add(from(0), d[2], -(d[0] * z[i]));
    y[i] = fused_multiply_add(from(1), d[2], -(d[1] * z[i]));
  };
  shear(0);
  shear(1);
  shear(2);
  const auto edge = [&](unsigned i, unsigned j)
                        HIPRT_FORCE_INLINE_LAMBDA { return fused_multiply_add(x[i], y[j], -(y[i] * x[j])); };
  const auto magnitude = [](double a) HIPRT_FORCE_INLINE_LAMBDA { return a < 0.0 ? -a : a; };
  const double w0 = edge(1, 2), w1 = edge(2, 0), w2 = edge(0, 1),
               least = 0x1p-26 * static_cast<double>(uncertainty) * (d[2] * d[2]);
  if ((w0 > least || w1 > least || w2 > least) && (w0 < -least || w1 < -least || w2 < -least)) return InDouble::kMisses;
  if (!(magnitude(w0) > least && magnitude(w1) > least && magnitude(w2) > least)) return InDouble::kUndecided;
  // One division serves both uses.
  const double sum = w0 + w1 + w2, inverse = 1.0 / (sum * d[2]), scale = inverse * d[2];
  const double slope1 = z[1] - z[0], slope2 = z[2] - z[0], spread = magnitude(slope1) + magnitude(slope2);
  const double depth = fused_multiply_add(fused_multiply_add(w1, slope1, w2 * slope2), scale, z[0]);
  // The error of a weight is at most 4 times this.
  const double off = least * magnitude(scale);
  const double error = fused_multiply_add(4.0 * off, spread, 0x1p-50 * (magnitude(z[0]) + spread));
  const bool behind = d[2] > 0.0 ? depth < -error : depth > error;
  if (!(off < 0x1p-26) || (!behind && !(error < 0x1p-26 * magnitude(depth)))) return InDouble::kUndecided;
  result = {static_cast<float>(depth * (inverse * sum)), static_cast<float>(w1 * scale), static_cast<float>(w2 * scale),
            is_front(sum, d[2])};
  return InDouble::kPasses;
}

/// The exact decision whether and where a line passes through a triangle.
///
/// A line through an edge or a corner is treated as a line beside it. It is moved by e, e^2, e^3 along the axes, for a
/// small enough e (simulation of simplicity, Edelsbrunner and Muecke 1990). A line parallel to an edge is parallel to
/// the triangle, so it does not pass.
class ExactDecision {
 public:
  using Vectors = LineAndTriangle;

  /// @param of origin, direction and corners.
  HIPRT_HD HIPRT_FORCE_INLINE explicit ExactDecision(const LineAndTriangle& of) : of_(of) {
    for (unsigned i = 0; i < 3; ++i) {
      for (unsigned k = 0; k < 3; ++k) of_.vector[Vectors::kAxis + i][k] = i == k ? 1.0f : 0.0f;
      of_.vector[Vectors::kMinusOrigin][i] = -of_.vector[Vectors::kOrigin][i];
      of_.vector[Vectors::kZero][i] = 0.0f;
    }
  }

  /// @return false: the line does not pass, or it is parallel to the triangle. Otherwise t, u and v are set, rounded
  /// from values within 2^-28 of t and of 1.
  HIPRT_HD HIPRT_FORCE_INLINE bool passes(Candidate& result) {
    // Edge functions opposite to corners 0, 1 and 2; the product along the normal; the plane's distance along the
    // normal.
    double value[5] = {};
    bool positive = false, negative = false, front = false;
    HIPRT_NO_UNROLL
    for (unsigned step = 0; step < 5; ++step) {
      const int sign = find(step, value[step]);
      front = step == 3 ? sign < 0 : front;
      positive = positive || (step < 3 && sign > 0);
      negative = negative || (step < 3 && sign < 0);
      // An edge that is parallel to the line, or has no length, has no sign.
      if ((positive && negative) || (step < 4 && sign == 0)) return false;
    }
    result = {static_cast<float>(value[4] / value[3]), static_cast<float>(value[1] / value[3]),
              static_cast<float>(value[2] / value[3]), front};
    return true;
  }

 private:
  /// Numbers of the two corners of an edge.
  HIPRT_HD static HIPRT_FORCE_INLINE unsigned edge_from(unsigned step) {
    return Vectors::kCorner + (step == 2 ? 0 : step + 1);
  }
  HIPRT_HD static HIPRT_FORCE_INLINE unsigned edge_to(unsigned step) {
    return Vectors::kCorner + (step == 0 ? 2 : step - 1);
  }

  /// A value and its sign.
  HIPRT_HD HIPRT_FORCE_INLINE int find(unsigned step, double& value) const {
    const unsigned corner = Vectors::kCorner, origin = Vectors::kOrigin;
    const unsigned minuend[3] = {step == 4 ? corner : Vectors::kDirection, step < 3 ? edge_from(step) : corner + 1,
                                 step < 3 ? edge_to(step) : corner + 2};
    const unsigned subtrahend[3] = {step == 4 ? origin : Vectors::kZero, step < 3 ? origin : corner,
                                    step < 3 ? origin : corner};
    const RoundedDeterminant rounded(of_, minuend, subtrahend);
    value = rounded.value;
    // Not only the sign must be certain: u, v and t are computed from the values.
    const double least = 0x1p30 * rounded.error;
    if (value > least) return 1;
    if (value < -least) return -1;
    int sign = 0;
    HIPRT_NO_UNROLL
    for (unsigned attempt = 0; attempt < 4; ++attempt) {
      ExactSum<48> sum;
      add_terms(sum, step, attempt);
      sign = sum.sign();
      if (attempt == 0) value = sum.value();
      if (step > 2 || sign != 0) break;
    }
    return sign;
  }

  /// Each is a sum of determinants det[first, list k, list k + 1].
  HIPRT_HD HIPRT_FORCE_INLINE void add_terms(ExactSum<48>& sum, unsigned step, unsigned attempt) const {
    unsigned first = Vectors::kDirection, list[3] = {Vectors::kCorner, Vectors::kCorner + 1, Vectors::kCorner + 2};
    unsigned count = 3;
    if (step < 3) {
      // First det[direction, a - origin, b - origin]. If it is 0, the line is moved by h: dot(h, cross(direction, b -
      // a)). That is 0 along all axes only if direction and edge are parallel.
      list[0] = edge_from(step);
      list[1] = edge_to(step);
      list[2] = Vectors::kOrigin;
      if (attempt > 0) {
        first = Vectors::kAxis + attempt - 1;
        list[2] = list[1];
        list[1] = Vectors::kDirection;
        count = 2;
      }
    } else if (step == 4) {
      first = Vectors::kMinusOrigin;  // One more vector, behind the others.
      count = 4;
    }
    HIPRT_NO_UNROLL
    for (unsigned k = 0; k < count; ++k) {
      const unsigned from = k < 3 ? k : 1, to = k < 3 ? (k == 2 ? 0 : k + 1) : 2;
      sum.add_determinant(of_.vector[k < 3 ? first : list[0]], of_.vector[list[from]], of_.vector[list[to]]);
    }
  }

  Vectors of_;
};

}  // namespace exact_detail

/// Decides exactly by the triangle and the ray themselves, for all finite floats. t is within one unit in its last
/// place.
///
/// A filter in float decides nearly all cases: the sheared edge functions with a bound of the shear's rounding, one
/// bound per leaf. The remaining cases are decided in double, and then exactly (docs/proofs/exact-decisions.md).
///
/// A line through an edge or a corner is decided as a line that lies beside it by less than any float. It is always
/// the same line for a ray. Where a ray passes through the surface at a shared edge, it meets one of the triangles.
/// Where it touches the surface, it meets none or two. So every ray from outside crosses a closed surface an even
/// number of times, also counted by AllHits. A triangle without area, or seen exactly edge-on, is never hit.
struct Reference : ShearedTriangleTest<Reference> {
  template <class Lanes> struct PreparedRay : ShearedRay<Lanes> {
    float dx, dy, dz;  ///< The direction, in the sheared space's axes.
    HIPRT_HD HIPRT_FORCE_INLINE explicit PreparedRay(const Ray& ray)
        : ShearedRay<Lanes>(ray),
          dx(this->component(ray.direction, this->x())),
          dy(this->component(ray.direction, this->y())),
          dz(this->component(ray.direction, this->z)) {}
  };

  /// See ShearedTriangleTest::meet().
  template <class Lanes, class Leaf, class Accept>
  HIPRT_HD static HIPRT_FORCE_INLINE bool intersect(const Leaf& leaf, const LeafInfo& info,
                                                    const PreparedRay<Lanes>& ray, Accept&& accept) {
    return meet<Lanes>(leaf, info, ray, accept);
  }

  struct Bounds;

  /// As intersect(), for one triangle of the leaf.
  /// @param id its part of LeafInfo::triangle_ids.
  template <class Lanes, class Leaf>
  HIPRT_HD static HIPRT_FORCE_INLINE bool decide(const Leaf& leaf, const PreparedRay<Lanes>& ray, bool second,
                                                 std::uint32_t id, Candidate& result) {
    return decide_by<Lanes, true>(leaf, ray, second, id, 0.0f, result);
  }

  /// Bound of the error of the leaf's edge functions (docs/proofs/exact-decisions.md).
  ///
  /// Let u = 2^-24 and the shear at most s. The error of a sheared coordinate is at most u (2 |x| + 3 s |z|). Let R be
  /// the largest |x| + |y| + s |z| of the leaf's vertices, and T the largest |x| + |y|. The error of an edge function
  /// is at most 6 u R (T + 3 u R).
  template <class Lanes, class Vertices>
  HIPRT_HD static HIPRT_FORCE_INLINE float uncertainty(const Vertices& at, const PreparedRay<Lanes>& ray) {
    const auto beside = Lanes::add(Lanes::magnitude(at.x), Lanes::magnitude(at.y));
    const auto far = Lanes::madd(Lanes::magnitude(at.z), Lanes::all(most_shear<Lanes>(ray)), beside);
    return uncertainty_of(Lanes::largest(beside), Lanes::largest(far));
  }

 private:
  friend ShearedTriangleTest;

  /// The triangle in the sheared space's axes, corners in the mesh's order.
  template <class Lanes, class Leaf>
  HIPRT_HD static HIPRT_FORCE_INLINE exact_detail::LineAndTriangle read(const Leaf& leaf, const PreparedRay<Lanes>& ray,
                                                                        bool second, std::uint32_t id) {
    exact_detail::LineAndTriangle of;
    const auto read_axis = [&](unsigned axis, unsigned from, float origin, float direction) HIPRT_FORCE_INLINE_LAMBDA {
      float corner[3];
      corners_of<Lanes>(load_coordinates<Lanes>(leaf, from), second, id, corner);
      of.vector[0][axis] = origin;
      of.vector[1][axis] = direction;
      of.vector[2][axis] = corner[0];
      of.vector[3][axis] = corner[1];
      of.vector[4][axis] = corner[2];
    };
    read_axis(0, ray.x(), Lanes::value(ray.ox), ray.dx);
    read_axis(1, ray.y(), Lanes::value(ray.oy), ray.dy);
    read_axis(2, ray.z, Lanes::value(ray.oz), ray.dz);
    return of;
  }

  /// As uncertainty(), for the triangle alone.
  template <class Lanes>
  HIPRT_HD static HIPRT_FORCE_INLINE float own_uncertainty(const exact_detail::LineAndTriangle& of,
                                                           const PreparedRay<Lanes>& ray) {
    const float shear = most_shear<Lanes>(ray);
    float width = 0.0f, reach = 0.0f;
    const auto read = [&](const float(&corner)[3]) HIPRT_FORCE_INLINE_LAMBDA {
      const float z = corner[2] - of.vector[0][2];
      const float beside = absolute(fused_multiply_add(-Lanes::value(ray.sx), z, corner[0] - of.vector[0][0])) +
                           absolute(fused_multiply_add(-Lanes::value(ray.sy), z, corner[1] - of.vector[0][1]));
      // Where coordinates overflow, the uncertainty is infinite, never NaN.
      constexpr float kInfinity = std::numeric_limits<float>::infinity();
      width = larger(width, smaller(beside, kInfinity));
      reach = larger(reach, smaller(fused_multiply_add(shear, absolute(z), beside), kInfinity));
    };
    read(of.vector[2]);
    read(of.vector[3]);
    read(of.vector[4]);
    return uncertainty_of(width, reach);
  }

  template <class Lanes> HIPRT_HD static HIPRT_FORCE_INLINE float most_shear(const PreparedRay<Lanes>& ray) {
    return larger(absolute(Lanes::value(ray.sx)), absolute(Lanes::value(ray.sy)));
  }

  HIPRT_HD static HIPRT_FORCE_INLINE float uncertainty_of(float width, float reach) {
    constexpr float kUnit = 0x1p-24f;
    // Fused, so that the bits are the same everywhere.
    return fused_multiply_add(7.0f * kUnit * reach, fused_multiply_add(4.0f * kUnit, reach, width), kTiny);
  }

  template <class Lanes, class Leaf>
  HIPRT_HD static HIPRT_FORCE_INLINE bool finish(const TriangleCorners<float>& corners, const Leaf& leaf,
                                                 const PreparedRay<Lanes>& ray, bool second, std::uint32_t id,
                                                 Candidate& result) {
    return decide_by<Lanes, false>(leaf, ray, second, id, corners.uncertainty * (1.0f + 0x1p-20f), result);
  }

  /// @tparam kOwn whether to use the uncertainty of the triangle alone.
  /// @param uncertainty otherwise, that of the whole leaf.
  template <class Lanes, bool kOwn, class Leaf>
  HIPRT_HD static HIPRT_FORCE_INLINE bool decide_by(const Leaf& leaf, const PreparedRay<Lanes>& ray, bool second,
                                                    std::uint32_t id, float uncertainty, Candidate& result) {
    using namespace exact_detail;
    const LineAndTriangle of = read<Lanes>(read_again(leaf), ray, second, id);
    // A decision with the uncertainty of the whole leaf also holds with the triangle's own. In the end only the
    // triangle counts, so the result does not depend on the leaf's other triangle.
    if constexpr (kOwn) uncertainty = own_uncertainty<Lanes>(of, ray);
    for (bool own = kOwn;; own = true) {
      const InDouble decision = find_in_double(of, uncertainty, result);
      if (decision != InDouble::kUndecided) return decision == InDouble::kPasses;
      if (own) return ExactDecision(of).passes(result);
      uncertainty = own_uncertainty<Lanes>(of, ray);
    }
  }
};

/// Bounds of t, which suffice to choose between nearly all hits (DeferringTest).
///
/// t = sum(w_i z_i) / (s dz), s = sum(w_i). Let all w_i have one certain sign, and let the error e_i of each be at
/// most the uncertainty U. The depth is between the z_i. So its error is |sum(e_i (z_i - depth))| / |s| <= 2 U (max z
/// - min z) / |s|.
///
/// Roundings, in units u = 2^-24 of max |z|: 1 of z_i, 4 of w_i besides U, 3 of the sum of products, and 5 of s, s dz,
/// quotient and product. The result of decide() is within 2 u of the exact t. The bounds are wider than the sum of all
/// these. Underflow moves a depth by less than 2^-122, also where subnormal numbers are flushed.
struct Reference::Bounds : ShearedTriangleTest<Bounds> {
  template <class Lanes> using PreparedRay = Reference::PreparedRay<Lanes>;

  template <class Lanes, class Leaf, class Accept>
  HIPRT_HD static HIPRT_FORCE_INLINE bool intersect(const Leaf& leaf, const LeafInfo& info,
                                                    const PreparedRay<Lanes>& ray, Accept&& accept) {
    return Bounds::template meet<Lanes>(leaf, info, ray, accept);
  }

 private:
  friend ShearedTriangleTest<Bounds>;

  template <class Lanes, class Vertices>
  HIPRT_HD static HIPRT_FORCE_INLINE float uncertainty(const Vertices& at, const PreparedRay<Lanes>& ray) {
    return Reference::uncertainty<Lanes>(at, ray);
  }

  template <class Lanes, class Leaf>
  HIPRT_HD static HIPRT_FORCE_INLINE bool finish(const TriangleCorners<float>& corners, const Leaf&,
                                                 const PreparedRay<Lanes>& ray, bool, std::uint32_t,
                                                 Candidate& result) {
    const float(&w)[3] = corners.weight;
    const float(&z)[3] = corners.z;
    const float dz = ray.dz;
    const float sum = w[0] + w[1] + w[2], inverse = divided(1.0f, sum * dz), size = absolute(inverse);
    const float t = fused_multiply_add(w[0], z[0], fused_multiply_add(w[1], z[1], w[2] * z[2])) * inverse;
    const float nearest = smaller(smaller(z[0], z[1]), z[2]), farthest = larger(larger(z[0], z[1]), z[2]);
    const float off = fused_multiply_add(
        2.25f * corners.uncertainty, farthest - nearest,
        fused_multiply_add(16.0f * 0x1p-24f * larger(absolute(nearest), absolute(farthest)), absolute(sum), 0x1p-122f));
    const float error = fused_multiply_add(off, size, fused_multiply_add(absolute(t), 0x1p-21f, 0x1p-122f));
    // Outside this range products and quotient may have lost digits.
    const bool is_good = corners.are_certain() & (size > 0x1p-100f) & (size < 0x1p100f) & (error < 0x1p126f);
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    result = {is_good ? t + error : kInfinity, is_good ? t - error : -kInfinity, 0.0f};
    return true;
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
