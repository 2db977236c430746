// Bounds of instances by rational arithmetic, and of moving points by dense sampling in long double.

#include <hiprt_build/format/motion_curve.h>
#include <hiprt_device/math/affine.h>
#include <tests/oracle/exact.h>
#include <tests/oracle/random.h>

#include <tests/catch.h>

#include <cmath>

using namespace hiprt;
using namespace hiprt::oracle;

namespace {

constexpr std::uint64_t kSeed = 20261127;

struct ExactInverse {
  Rational row[3][3];

  /// @return false: the matrix is singular.
  bool set(const InstanceRecord& record) {
    Rational m[3][3];
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) m[r][c] = exact(record.linear[r][c]);
    const auto cofactor = [&](unsigned r, unsigned c) {
      const unsigned r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
      return Rational(m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]);
    };
    const Rational determinant = m[0][0] * cofactor(0, 0) + m[0][1] * cofactor(0, 1) + m[0][2] * cofactor(0, 2);
    if (determinant == 0) return false;
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) row[r][c] = cofactor(c, r) / determinant;
    return true;
  }
};

InstanceRecord random_record(Random& random, unsigned i) {
  InstanceRecord record{};
  for (unsigned r = 0; r < 3; ++r) {
    for (float& x : record.linear[r]) x = random.uniform_float(-1, 1);
    record.translation[r] = i % 2 == 0 ? random.uniform_float(-10, 10) : 0.0f;
  }
  // Nearly singular: the last row is nearly a sum of the others.
  if (i % 3 == 0)
    for (unsigned c = 0; c < 3; ++c)
      record.linear[2][c] = record.linear[0][c] + record.linear[1][c] +
                            static_cast<float>(random.log_uniform(1e-6, 1e-1)) * record.linear[2][c];
  return record;
}

}  // namespace

TEST_CASE("boxes of still instances contain every rational corner and are tight", "[bounds]") {
  Random random(kSeed);
  for (unsigned i = 0; i < 3000; ++i) {
    const InstanceRecord record = random_record(random, i);
    ExactInverse inverse;
    if (!inverse.set(record)) continue;
    const auto low = random.in_cube(1), size = random.in_cube(1);
    Box box;
    for (unsigned k = 0; k < 3; ++k) {
      box.min[k] = std::min(low[k], low[k] + size[k]);
      box.max[k] = std::max(low[k], low[k] + size[k]);
    }
    const Box bounds = StillInstanceBounds(record).bounds(box);
    for (unsigned r = 0; r < 3; ++r) {
      Rational least = exact(record.translation[r]), most = least, reach = 0;
      for (unsigned c = 0; c < 3; ++c) {
        const Rational a = inverse.row[r][c] * exact(box.min[c]), b = inverse.row[r][c] * exact(box.max[c]);
        least += a < b ? a : b;
        most += a < b ? b : a;
        reach += abs(a) + abs(b);
      }
      INFO("seed " << kSeed << ", instance " << i << ", axis " << r);
      REQUIRE(exact(bounds.min[r]) <= least);
      REQUIRE(exact(bounds.max[r]) >= most);
      // One float, and the share of double arithmetic.
      const Rational slack = reach * Rational(1, 1 << 20) + exact(0x1p-22f) * (abs(least) + abs(most));
      if (i % 3 != 0) REQUIRE(least - exact(bounds.min[r]) <= slack);
    }
  }
}

TEST_CASE("the slack of still instances holds the error of the inverse in double", "[bounds]") {
  Random random(kSeed + 1);
  double most = 0.0;
  for (unsigned i = 0; i < 3000; ++i) {
    const InstanceRecord record = random_record(random, 0);
    ExactInverse exact_inverse;
    if (!exact_inverse.set(record)) continue;
    const LinearInverse inverse(record);
    const double unit = 0x1p-48 * (1.0 + inverse.norm() * affine_detail::norm(record.linear)) * inverse.norm();
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) {
        const Rational error = abs(Rational(inverse.row[r][c]) - exact_inverse.row[r][c]);
        most = std::max(most, error.get_d() / unit);
      }
  }
  // An error of an entry is at most about 2^-51 (1 + condition) magnification.
  CHECK(most < 0.25);
  CHECK(most > 1e-6);
  // The pad itself, where the sum of exact products is 0: 2^-48 of the terms, and no less.
  InstanceRecord record{};
  for (unsigned k = 0; k < 3; ++k) record.linear[k][k] = 1.0f;
  const Box point{{0, 1, 0}, {0, 1, 0}};
  CHECK(StillInstanceBounds(record).bounds(point).max[0] == 0x1p-48f * 2);
  CHECK(StillInstanceBounds(record).bounds(point).min[0] == -0x1p-48f * 2);
}

TEST_CASE("bounds of a moving point's derivatives hold, term by term, up to a right angle", "[bounds]") {
  Random random(kSeed + 2);
  for (unsigned i = 0; i < 300; ++i) {
    MotionCurve curve{{random.uniform(-1, 1), random.uniform(-1, 1)},
                      {random.uniform(-1, 1), random.uniform(-1, 1)},
                      {random.uniform(-1, 1), random.uniform(-1, 1)},
                      i % 4 == 0 ? 1.5707963 : random.uniform(0.5, 1.5707963),
                      i % 5 != 0};
    const double step = 1e-4;
    double fastest = 0.0, bend = 0.0, turning = 0.0, acceleration = 0.0;
    const auto speed_of_angle = [&](double s) {
      if (!curve.normalised) return curve.angle;
      const double across = s * std::sin(curve.angle), along = 1.0 - s + s * std::cos(curve.angle);
      return std::sin(curve.angle) / (across * across + along * along);
    };
    for (double s = step; s < 1.0 - step; s += 1e-3) {
      fastest = std::max(fastest, std::fabs(curve.at(s).derivative));
      bend = std::max(bend, std::fabs(curve.at(s + step).derivative - curve.at(s - step).derivative) / (2 * step));
      turning = std::max(turning, speed_of_angle(s));
      acceleration =
          std::max(acceleration, std::fabs(speed_of_angle(s + step) - speed_of_angle(s - step)) / (2 * step));
    }
    INFO("seed " << kSeed + 2 << ", curve " << i << ", angle " << curve.angle);
    REQUIRE(curve.speed() >= fastest * (1 - 1e-5));
    REQUIRE(curve.turning() >= turning * (1 - 1e-5));
    REQUIRE(curve.turning() <= turning * (1 + 1e-4));
    REQUIRE(curve.curvature() >= bend * (1 - 1e-5));
    const double still = 4.0 * curve.turning() * std::hypot(curve.g[1], curve.h[1]) +
                         4.0 * curve.amplitude() * curve.turning() * curve.turning();
    // So the acceleration is not needed. Files keep their bits with it.
    REQUIRE(still >= bend * (1 - 1e-5));
    REQUIRE(curve.curvature() - still >= 2.0 * curve.amplitude() * acceleration * (1 - 1e-4) - 1e-9);
  }
}
