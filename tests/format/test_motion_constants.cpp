// The constants of bounds in motion, each compared with the terms of its proof: docs/proofs/motion.md.

#include "test_scene.h"

#include <hiprt_build/format/moving_box.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/instances.h>
#include <tests/oracle/exact.h>
#include <tests/oracle/random.h>

#include <tests/catch.h>

#include <algorithm>
#include <cmath>

using namespace hiprt;
using namespace hiprt::format_detail;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261127;
constexpr double kUnit = 0x1p-24;

/// From a unit matrix to one with this diagonal and shear, from time 0 to 1, along x by @p gone.
MotionSegment matrix_segment(float scale, float gone) {
  MotionSegment segment{};
  segment.time[1] = 1.0f;
  segment.translation[1][0] = gone;
  for (unsigned k = 0; k < 3; ++k) segment.linear[0][k][k] = segment.linear[1][k][k] = k == 0 ? scale : 1.0f;
  return segment;
}

/// Stands still. @param scale along x. @param shear xy.
MotionSegment turning_segment(float scale, float shear) {
  MotionSegment segment{};
  segment.time[1] = 1.0f;
  segment.turning.rotation[0][3] = segment.turning.rotation[1][2] = 1.0f;
  for (float(&stretch)[6] : segment.turning.stretch) {
    stretch[0] = scale;
    stretch[1] = stretch[2] = 1.0f;
    stretch[3] = shear;
  }
  return segment;
}

MotionMagnification magnification_of(const MotionSegment& segment, MotionKind kind) {
  MotionMagnification sum;
  motion_detail::BadMatrix bad{};
  REQUIRE(magnify(sum, segment, kind, bad));
  return sum;
}

MotionCurve random_curve(Random& random, unsigned i) {
  return {{random.uniform(-1, 1), random.uniform(-1, 1)},
          {random.uniform(-1, 1), random.uniform(-1, 1)},
          {random.uniform(-1, 1), random.uniform(-1, 1)},
          random.uniform(0.25, 1.5707963),
          i % 2 == 0};
}

/// The curve's value in long double.
long double precise(const MotionCurve& curve, long double s) {
  const long double a = curve.angle;
  const long double phi = curve.normalised ? std::atan2(s * std::sin(a), 1.0L - s + s * std::cos(a)) : s * a;
  return curve.e[0] + s * curve.e[1] + (curve.g[0] + s * curve.g[1]) * std::cos(2 * phi) +
         (curve.h[0] + s * curve.h[1]) * std::sin(2 * phi);
}

/// The largest value, by dense sampling and golden section.
long double precise_maximum(const MotionCurve& curve) {
  constexpr int kSamples = 256;
  int best = 0;
  for (int i = 0; i <= kSamples; ++i)
    if (precise(curve, i / 256.0L) > precise(curve, best / 256.0L)) best = i;
  long double low = std::max(best - 1, 0) / 256.0L, high = std::min(best + 1, kSamples) / 256.0L;
  for (unsigned step = 0; step < 60; ++step) {
    const long double a = low + 0.382L * (high - low), b = high - 0.382L * (high - low);
    (precise(curve, a) < precise(curve, b) ? low : high) = precise(curve, a) < precise(curve, b) ? a : b;
  }
  return std::max({precise(curve, 0.0L), precise(curve, 0.5L * (low + high)), precise(curve, 1.0L)});
}

}  // namespace

TEST_CASE("planes that drift have room for four roundings of the time, and builders take five", "[motion]") {
  // part_of() rounds two differences and their quotient: 3 u. One more covers the second order.
  constexpr double kNeeded = 3;
  const MotionSegment segment = matrix_segment(1.0f, 1.0f);
  BoxDrift drift;
  drift.min[0] = drift.max[0] = 0.5;
  const InstanceRecord still{};
  const Box point{{0, 0, 0}, {0, 0, 0}};
  const auto low = [&](double slack) {
    return double{InstanceDriftBounds(still, std::span(&segment, 1), MotionKind::kMatrix, {0, 1}, drift, slack)
                      .bounds(point)
                      .min[0]};
  };
  // The plane drifts at half of the speed of 1. So the point is lowest at the begin.
  CHECK(low(0.0) == -4 * kUnit);
  CHECK(low(0.0) <= -(kNeeded + 0x1p-10) * kUnit);
  CHECK(low(1.0) <= -5 * kUnit);
  CHECK(low(1.0) >= -5 * kUnit - 0x1p-44);
  // Planes that do not drift hold at all times.
  drift = {};
  CHECK(low(0.0) == 0.0);
}

TEST_CASE("a value of a curve has a pad of 2^-46 of the magnitude, six times its error", "[motion]") {
  // In units of 2^-53: phi has at most 6, so cos and sin of 2 phi 13; products and sums add 7.
  constexpr double kNeeded = 13 + 7;
  CHECK(kNeeded * 6 <= 0x1p7);
  Random random(kSeed);
  double most = 0.0;
  for (unsigned i = 0; i < 20000; ++i) {
    const MotionCurve curve = random_curve(random, i);
    const double s = random.unit(), gone = random.uniform(-1, 1);
    const long double error = std::fabs(precise(curve, s) - static_cast<long double>(curve.at(s).value));
    most = std::max(most, static_cast<double>(error) / (0x1p-53 * curve.magnitude()));
    MotionRange range;
    curve.grow_at(range, s, gone, 1.0);
    const double pad = 0.5 * (range.high - range.low), wanted = 0x1p-46 * (curve.magnitude() + std::fabs(gone));
    INFO("seed " << kSeed << ", curve " << i);
    REQUIRE(std::fabs(pad - wanted) <= 0x1p-51);
    MotionRange bare;
    curve.grow_at(bare, s, gone, 0.0);
    REQUIRE(bare.low == bare.high);
  }
  INFO("seed " << kSeed);
  CHECK(most <= kNeeded);
  CHECK(most >= 0.5);
}

TEST_CASE("boxes of points that a translation takes back to 0 are too small by at most what sums round", "[motion]") {
  Random random(kSeed + 2);
  unsigned outside = 0;
  for (unsigned i = 0; i < 8000; ++i) {
    MotionSegment segment{};
    segment.time[1] = 1.0f;
    float p[3];
    for (float& x : p) x = random.uniform_float(-1, 1);
    for (unsigned r = 0; r < 3; ++r) {
      double row = 0;
      for (unsigned c = 0; c < 3; ++c) {
        segment.linear[0][r][c] = segment.linear[1][r][c] = random.uniform_float(-1, 1);
        row += double{segment.linear[0][r][c]} * double{p[c]};
      }
      segment.translation[0][r] = segment.translation[1][r] = static_cast<float>(-row);
    }
    const SegmentMotion motion(segment, MotionKind::kMatrix);
    const Box box = bounds_in_motion(std::span(&motion, 1), Box{{p[0], p[1], p[2]}, {p[0], p[1], p[2]}});
    for (unsigned r = 0; r < 3; ++r) {
      oracle::Rational value = oracle::exact(segment.translation[0][r]), size = abs(value);
      for (unsigned c = 0; c < 3; ++c) {
        const oracle::Rational term = oracle::exact(segment.linear[0][r][c]) * oracle::exact(p[c]);
        value += term;
        size += abs(term);
      }
      INFO("seed " << kSeed + 2 << ", point " << i << ", axis " << r);
      const oracle::Rational rounding = size * oracle::exact(3 * 0x1p-53f);
      REQUIRE(oracle::exact(box.min[r]) <= value + rounding);
      REQUIRE(oracle::exact(box.max[r]) >= value - rounding);
      if (oracle::exact(box.min[r]) > value || oracle::exact(box.max[r]) < value) ++outside;
    }
  }
  CHECK(outside > 0);
}

TEST_CASE("ranges of curves end within 2^-26 of the magnitude, outside with slack and inside without", "[motion]") {
  Random random(kSeed + 1);
  double outside = 0.0, inside = 0.0;
  for (unsigned i = 0; i < 400; ++i) {
    const MotionCurve curve = random_curve(random, i);
    MotionRange loose, tight;
    curve.grow(loose, 1.0);
    curve.grow(tight, 0.0);
    const long double most = precise_maximum(curve);
    const double unit = 0x1p-26 * curve.magnitude(), pad = 0x1p-46 * curve.magnitude();
    INFO("seed " << kSeed + 1 << ", curve " << i);
    REQUIRE(loose.high >= most);
    REQUIRE(loose.high <= most + unit + 2 * pad);
    REQUIRE(tight.high <= most + pad);
    REQUIRE(tight.high >= most - unit);
    outside = std::max(outside, static_cast<double>(loose.high - most) / unit);
    inside = std::max(inside, static_cast<double>(most - tight.high) / unit);
  }
  // Halves stop between a quarter of the tolerance and the tolerance.
  INFO("seed " << kSeed + 1 << ": " << outside << " outside, " << inside << " inside");
  CHECK(outside > 0.5);
  CHECK(inside > 0.02);
}

TEST_CASE("the rounding of motions is the sum of motion.md, in units of the margin for instances", "[motion]") {
  // The margin has 14 S per unit of condition.
  constexpr double kMargin = 14;
  // A rotation by 23 and a shift along the arc of 5; 4 per entry of the matrix. Entries of U 3, back substitution 5.
  CHECK(35 >= 23 + 5 + 4);
  const auto still = magnification_of(turning_segment(1, 0), MotionKind::kSlerp);
  CHECK(still.rounding == (35 + (3 + 5)) / kMargin);
  CHECK(magnification_of(turning_segment(8, 0), MotionKind::kNlerp).rounding == (35 + (3 + 5)) / kMargin);
  const auto sheared = magnification_of(turning_segment(8, 0.5f), MotionKind::kSlerp);
  const double c = sheared.condition;
  CHECK(c > 8);
  CHECK(sheared.rounding == Approx((35 + (3 + 5) * 3 * c * c) / kMargin).epsilon(1e-14));
  // Matrices are inverted in double and rounded once.
  CHECK(magnification_of(matrix_segment(1, 0), MotionKind::kMatrix).rounding == (6 + 2) / kMargin);
  const auto matrix = magnification_of(matrix_segment(8, 3), MotionKind::kMatrix);
  CHECK(matrix.condition >= 8);
  CHECK(matrix.rounding == Approx((6 + 2 * matrix.condition) / kMargin).epsilon(1e-14));
  CHECK(matrix.longest == Approx(8).epsilon(1e-12));
  CHECK(matrix.farthest == 3);
}

TEST_CASE("the rounding and the reach of a moving instance's record are rounded up", "[motion]") {
  const test::TestFile object = test::root_leaf_scene(NodeLayout::kPlanes).write();
  const std::span<const std::byte> files[] = {object.bytes()};
  // 43 / 14 and the root of 3 lie above the nearest float.
  const build::Motion motion{
      .keys = {{.time = 0, .translation = {1, 1, 1}}, {.time = 1, .translation = {1, 0, 1}, .rotation = {0, 0, 1, 1}}}};
  const std::vector<build::Instance> group{{.motion = &motion}};
  const auto scene = build::build_instances(files, group);
  REQUIRE(scene);
  const auto view = open_buffer(scene->buffer.bytes());
  REQUIRE(view);
  const MotionRecord& record = view->motions[0];
  CHECK(double{static_cast<float>(43.0 / 14)} < 43.0 / 14);
  CHECK(record.rounding == std::nextafter(static_cast<float>(43.0 / 14), 4.0f));
  CHECK(double{static_cast<float>(std::sqrt(3.0))} < std::sqrt(3.0));
  CHECK(record.farthest == std::nextafter(static_cast<float>(std::sqrt(3.0)), 2.0f));
}
