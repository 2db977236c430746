// Exact crossings of lines and round cones against known values and against the distance to the surface.

#include <tests/oracle/random.h>
#include <tests/oracle/round_cone_distance.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::oracle;

namespace {

constexpr std::uint64_t kSeed = 20270101;

LineAndBalls along_z(double x, double y, double p1z, double r0, double r1) {
  return {{x, y, -10}, {0, 0, 1}, {0, 0, 0}, {0, 0, p1z}, r0, r1};
}

LineAndBalls across(double y, double z, double r0, double r1) {
  return {{-10, y, z}, {1, 0, 0}, {0, 0, 0}, {0, 0, 4}, r0, r1};
}

void check_crossings(const LineAndBalls& in, double enter, double exit) {
  const auto found = cross_exactly(in);
  REQUIRE(found);
  CHECK(found->enter.get_d() == Approx(enter).epsilon(1e-15));
  CHECK(found->exit.get_d() == Approx(exit).epsilon(1e-15));
}

/// Balls of all kinds and a line near them. Components up to about 10.
LineAndBalls random_case(Random& random) {
  LineAndBalls in{};
  const bool lattice = random.below(3) == 0;
  const auto number = [&] { return lattice ? double(random.below(7)) - 3 : double(random.uniform_float(-3, 3)); };
  for (std::size_t k = 0; k < 3; ++k) in.p0[k] = number(), in.p1[k] = number(), in.origin[k] = 3 * number();
  in.r0 = lattice ? random.below(4) : random.log_uniform(1e-3, 3);
  in.r1 = random.below(4) == 0 ? in.r0 : random.below(4) == 0 ? 0.0 : lattice ? random.below(4) : random.unit();
  if (in.r0 == 0.0 && in.r1 == 0.0) in.r0 = 1.0;
  const double s = random.unit();
  for (std::size_t k = 0; k < 3; ++k) {
    in.direction[k] = in.p0[k] + s * (in.p1[k] - in.p0[k]) + random.uniform(-1.5, 1.5) * in.r0 - in.origin[k];
    if (lattice) in.direction[k] = std::nearbyint(in.direction[k]);
  }
  if (in.direction[0] == 0.0 && in.direction[1] == 0.0 && in.direction[2] == 0.0) in.direction[2] = 1.0;
  return in;
}

/// The smallest value of a convex function on [low, high], by golden section; also where.
template <class Function> std::pair<Real, Real> smallest(Real low, Real high, const Function& f) {
  constexpr Real kRatio = 0.618033988749894848204586834L;
  Real a = high - kRatio * (high - low), b = low + kRatio * (high - low), fa = f(a), fb = f(b);
  for (int i = 0; i < 150; ++i) {
    if (fa < fb) {
      high = b, b = a, fb = fa, a = high - kRatio * (high - low), fa = f(a);
    } else {
      low = a, a = b, fa = fb, b = low + kRatio * (high - low), fb = f(b);
    }
  }
  return {fa < fb ? fa : fb, fa < fb ? a : b};
}

}  // namespace

TEST_CASE("balls: through the middle, beside it, a tangent, one inside the other", "[oracle]") {
  const auto ball = [](double x, double r) { return along_z(x, 0, 0, r, 0); };
  check_crossings(ball(0, 1), 9, 11);
  check_crossings(ball(3, 5), 6, 14);
  check_crossings(ball(1, 1), 10, 10);
  CHECK_FALSE(cross_exactly(ball(std::nextafter(1.0, 2.0), 1)));
  CHECK_FALSE(cross_exactly(along_z(0, 0, 4, 0, 0)));
  check_crossings(along_z(0, 0, 1, 3, 2), 7, 13);  // Touching from inside: k = 0.
  check_crossings(along_z(0, 0, 1, 1, 4), 7, 15);
}

TEST_CASE("round cones: along the axis, across it, at the seams, at tips", "[oracle]") {
  check_crossings(along_z(0, 0, 4, 1, 2), 9, 16);
  check_crossings(along_z(1, 0, 4, 1, 1), 10, 14);  // In the mantle of a cylinder: between the seams.
  CHECK_FALSE(cross_exactly(along_z(std::nextafter(1.0, 2.0), 0, 4, 1, 1)));
  check_crossings(across(0, 2, 1, 1), 9, 11);
  check_crossings(across(0.6, 2, 1, 1), 9.2, 10.8);
  check_crossings(across(1, 2, 1, 1), 10, 10);  // A tangent of the cylinder,
  check_crossings(across(1, 0, 1, 1), 10, 10);  // at the seam,
  check_crossings(across(0, 5, 1, 1), 10, 10);  // and at the pole of a cap.
  check_crossings(across(0, 4.6, 1, 1), 9.2, 10.8);
  CHECK_FALSE(cross_exactly(across(0, std::nextafter(5.0, 6.0), 1, 1)));
  // dr / L = 2.4 / 4 = 0.6 = sine, cosine 0.8: mantle radius (r0 + 0.6 z) / 0.8.
  check_crossings(across(0, 1, 1, 3.4), 8, 12);
  check_crossings(across(0, 1, 0, 2.4), 9.25, 10.75);
  check_crossings(across(0, 0, 0, 2.4), 10, 10);  // Through the tip.
  check_crossings(along_z(0, 0, 4, 0, 2.4), 10, 16.4);
  CHECK_FALSE(cross_exactly(across(0, -0x1p-100, 0, 2.4)));
}

TEST_CASE("roots: values to 150 bits, comparisons exact", "[oracle]") {
  const Root two(1, 0, -2, 1);  // sqrt(2)
  CHECK(abs(Rational(two.value() * two.value() - 2)) < Rational(1, Integer(1) << 148));
  const Integer convergent("131836323"), denominator("93222358");  // Of sqrt(2): too small by 4e-17.
  CHECK(two.compare(convergent, denominator) == sgn(Integer(2 * denominator * denominator - convergent * convergent)));
  CHECK(two.compare(-1, 1) == 1);
  CHECK(two.compare(7, -5) == 1);
  CHECK(Root(1, 0, -2, -1).compare(-7, 5) == -1);
  CHECK(Root(-1, 0, 4, 1).compare(-2, 1) == 0);
  CHECK(Root(0, 3, -12, 1).compare(2, 1) == 0);
  CHECK(Root(0, 3, -12, -1).value() == 2);
  // (-b + sqrt(b^2 - 1)) with a large b: about -1 / (2 b), all digits cancel.
  const Integer b = Integer(1) << 400;
  const Rational small = Root(1, b, 1, 1).value();
  CHECK(abs(Rational(small * 2 * b + 1)) < Rational(1, Integer(1) << 140));
}

TEST_CASE("crossings are zeros of the distance to the surface, and misses stay outside", "[oracle]") {
  INFO("seed " << kSeed);
  Random random(kSeed);
  int hits = 0, misses = 0;
  Real worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const LineAndBalls in = random_case(random);
    CAPTURE(i);
    const Real3 o = real3(in.origin), d = real3(in.direction);
    const auto distance = [&](Real t) { return distance_to_surface(in, plus(o, t, d)).value; };
    const Real scale = 30 / norm(d);  // Everything is within 30 of the origin.
    const auto [least, where] = smallest(-scale, scale, distance);
    const auto found = cross_exactly(in);
    if (!found) {
      ++misses;
      REQUIRE(least > -1e-15L);
      continue;
    }
    ++hits;
    REQUIRE(least < 1e-15L);
    const Real enter = found->enter.get_d(), exit = found->exit.get_d();
    REQUIRE(enter <= exit);
    worst = std::max({worst, std::abs(distance(enter)), std::abs(distance(exit))});
    if (least < -1e-9L) {
      REQUIRE((enter < where && where < exit));
      REQUIRE(distance(enter - 1e-9L * scale) > 0);
      REQUIRE(distance(exit + 1e-9L * scale) > 0);
    }
  }
  std::printf("round cone oracle: %d hits, %d misses, crossings within %.3Lg of the surface\n", hits, misses, worst);
  CHECK(hits > 5000);
  CHECK(misses > 3000);
  CHECK(worst < 4e-14L);  // The crossings were rounded to double: 2^-53 of up to 30 units or so.
}

TEST_CASE("crossings by sphere tracing from both sides", "[oracle]") {
  INFO("seed " << kSeed + 1);
  Random random(kSeed + 1);
  int traced = 0;
  for (int i = 0; i < 4000; ++i) {
    const LineAndBalls in = random_case(random);
    const auto found = cross_exactly(in);
    if (!found) continue;
    const Real3 o = real3(in.origin), d = real3(in.direction);
    const Real length = norm(d), chord = (Rational(found->exit - found->enter).get_d()) * length;
    if (chord < 1e-2L) continue;  // Steps get short along a tangent.
    const auto trace = [&](Real t, Real sign) {
      for (int step = 0; step < 100000; ++step) {
        const Real distance = distance_to_surface(in, plus(o, t, d)).value;
        if (distance < 1e-16L) break;
        t += sign * distance / length;
      }
      return t;
    };
    CAPTURE(i);
    ++traced;
    REQUIRE(std::abs(trace(-40 / length, 1) - Real{found->enter.get_d()}) * length < 1e-11L);
    REQUIRE(std::abs(trace(40 / length, -1) - Real{found->exit.get_d()}) * length < 1e-11L);
  }
  CHECK(traced > 1000);
}
