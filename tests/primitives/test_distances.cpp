// Closest points of spheres and round curves, against the support function of their hull in long double.

#include <tests/amount.h>
#include <tests/oracle/round_cone_distance.h>
#include <tests/primitives/shapes.h>

#include <tests/catch.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20271127;
constexpr long double kSphereShare = 0x1p-50L;  ///< Of the distance: sphere.h.
constexpr long double kCurveShare = 0x1p-48L;   ///< Of the distance of the farthest point: round_curve.h.
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

CustomPoint closest(const Case& c, const Vec3D& point) {
  const PointInObject at{point, std::numeric_limits<double>::infinity(), 0.0f};
  if (c.is_sphere) {
    const Sphere sphere{{c.a.position[0], c.a.position[1], c.a.position[2]}, c.a.radius};
    return SphereSet{&sphere}.closest(at, 0);
  }
  const CurveVertex vertices[] = {c.a, c.b};
  constexpr std::uint32_t kFirst = 0;
  return RoundCurveSet{vertices, &kFirst}.closest(at, 0);
}
CustomPoint of_sphere(const Sphere& s, const Vec3D& point) {
  return closest({true, {{s.center[0], s.center[1], s.center[2]}, s.radius}, {}, {}}, point);
}
CustomPoint of_curve(const CurveVertex& a, const CurveVertex& b, const Vec3D& point) {
  return closest({false, a, b, {}}, point);
}

/// A curve and a point in the half plane of the axis and the point.
struct Meridian {
  Real z, rho, length, r0, r1;

  Meridian(const LineAndBalls& in, const Real3& x) : r0(in.r0), r1(in.r1) {
    const Real3 y = minus(x, real3(in.p0)), w = minus(real3(in.p1), real3(in.p0));
    length = norm(w);
    const Real3 axis = length > 0 ? Real3{w[0] / length, w[1] / length, w[2] / length} : Real3{0, 0, 1};
    z = inner(y, axis);
    rho = norm(plus(y, -z, axis));
  }
  /// How far the point is beyond the tangent plane whose normal has an angle with the axis.
  Real beyond(Real angle) const {
    const Real along = std::cos(angle), across = std::sin(angle);
    return z * along + rho * across - std::max(r0, length * along + r1);
  }
  /// The distance from a convex solid, negative inside: the most that the point is beyond any tangent plane. The angles
  /// are tried densely, then by golden sections around the best.
  Real distance() const {
    constexpr int kSteps = 4000;
    constexpr Real kHalfTurn = 3.14159265358979323846264338327950288L;
    int best = 0;
    Real most = beyond(0);
    for (int i = 1; i <= kSteps; ++i)
      if (const Real at = beyond(kHalfTurn * i / kSteps); at > most) most = at, best = i;
    Real low = kHalfTurn * std::max(best - 1, 0) / kSteps, high = kHalfTurn * std::min(best + 1, kSteps) / kSteps;
    for (int i = 0; i < 120; ++i) {
      const Real a = low + 0.381966L * (high - low), b = low + 0.618034L * (high - low);
      (beyond(a) < beyond(b) ? low : high) = beyond(a) < beyond(b) ? a : b;
    }
    return std::max(most, beyond((low + high) / 2));
  }
};

Real3 in_space(const build::Position& p) { return {p[0], p[1], p[2]}; }
Real3 real3(const Vec3D& p) { return {p.x, p.y, p.z}; }
Real largest_coordinate(const LineAndBalls& in, const Real3& x) {
  Real most = 0;
  for (std::size_t k = 0; k < 3; ++k)
    most = std::max({most, std::abs(x[k]), std::abs(Real{in.p0[k]}), std::abs(Real{in.p1[k]})});
  return most;
}
/// The distance of the farthest point.
Real reach(const LineAndBalls& in, const Real3& x) {
  return std::max(norm(minus(x, oracle::real3(in.p0))) + in.r0, norm(minus(x, oracle::real3(in.p1))) + in.r1);
}

/// Compares one closest point with the oracle's distance. @return the error of the distance as a share of its bound.
Real check(const Case& c, const Vec3D& point) {
  const LineAndBalls in = exact_terms(c);
  const Real3 x = real3(point);
  const SurfaceDistance exact = distance_to_surface(in, x);
  const CustomPoint near = closest(c, point);
  const Real far = reach(in, x), rounding = 0x1p-52L * largest_coordinate(in, x);
  const Real bound = (c.is_sphere ? kSphereShare * std::abs(exact.value) : kCurveShare * far) + rounding;
  const Real off = std::abs(std::sqrt(Real{near.squared}) - std::abs(exact.value));
  const Real3 at = real3(near.point);
  INFO("a " << in.p0[0] << " " << in.p0[1] << " " << in.p0[2] << " r " << in.r0 << ", b " << in.p1[0] << " " << in.p1[1]
            << " " << in.p1[2] << " r " << in.r1 << ", point " << point.x << " " << point.y << " " << point.z << ": "
            << std::sqrt(near.squared) << ", exact " << static_cast<double>(exact.value) << ", off "
            << static_cast<double>(off) << ", bound " << static_cast<double>(bound));
  REQUIRE(off <= bound);
  // The point is on the surface, as far as its distance, and in the box.
  const Real loose = 0x1p-46L * far + 2 * rounding;
  REQUIRE(std::abs(distance_to_surface(in, at).value) <= loose);
  REQUIRE(std::abs(norm(minus(at, x)) - std::abs(exact.value)) <= loose);
  const Box box = c.is_sphere ? SphereSet::bounds({{c.a.position[0], c.a.position[1], c.a.position[2]}, c.a.radius})
                              : RoundCurveSet::bounds(c.a, c.b);
  for (std::size_t k = 0; k < 3; ++k) REQUIRE((at[k] >= box.min[k] - loose && at[k] <= box.max[k] + loose));
  // u names the ball that touches the surface there.
  REQUIRE((near.u >= 0 && near.u <= 1 && near.v >= 0 && near.v <= 1));
  if (!c.is_sphere) {
    const Real u = near.u, apart = norm(minus(oracle::real3(in.p1), oracle::real3(in.p0)));
    const Real3 center = plus(oracle::real3(in.p0), u, minus(oracle::real3(in.p1), oracle::real3(in.p0)));
    const Real radius = in.r0 + u * (Real{in.r1} - in.r0), angle = std::max(Real{1}, far / (apart + far));
    REQUIRE(std::abs(norm(minus(at, center)) - radius) <= loose * angle);
  }
  return off / bound;
}

}  // namespace

TEST_CASE("the oracle's formula is the distance from the hull's tangent planes", "[primitives]") {
  Random random(kSeed);
  for (const Shape shape : kShapes)
    for (unsigned i = 0; i < trials(60); ++i) {
      const LineAndBalls in = random_balls(shape, random);
      const Real3 x = in_space(random.in_cube(random.log_uniform(0.05, 4)));
      if (in.r0 == 0 && in.r1 == 0) continue;
      const Real expected = Meridian(in, x).distance();
      INFO(name(shape) << ", seed " << kSeed << ", trial " << i);
      REQUIRE(static_cast<double>(distance_to_surface(in, x).value) ==
              Approx(static_cast<double>(expected)).margin(1e-12));
    }
}

TEST_CASE("closest points of spheres and curves are within their bounds", "[primitives]") {
  Random random(kSeed + 1);
  Real worst_sphere = 0, worst_curve = 0;
  const Scales kinds[] = {{}, {.offset = 1e3}, {.distance = 1e7}, {.sizes = 1e25}, {.distance = 1e-2}};
  for (const Scales& scales : kinds)
    for (const Shape shape : kShapes)
      for (const Aim aim : kAims)
        for (unsigned i = 0; i < trials(60); ++i) {
          const Case c = random_case(shape, aim, scales.varied(random), random);
          const LineAndBalls in = exact_terms(c);
          if (in.r0 == 0 && in.r1 == 0) continue;
          INFO(name(shape) << ", " << name(aim) << ", seed " << kSeed + 1 << ", trial " << i);
          Vec3D point(c.ray.origin);
          // Points in double: between the ends, and on the line through them.
          const double share = random.uniform(-0.5, 1.5);
          if (i % 4 == 1)
            for (int k = 0; k < 3; ++k)
              point[k] = in.p0[static_cast<std::size_t>(k)] +
                         share * (in.p1[static_cast<std::size_t>(k)] - in.p0[static_cast<std::size_t>(k)]);
          Real& worst = c.is_sphere ? worst_sphere : worst_curve;
          worst = std::max(worst, check(c, point));
        }
  std::printf("distances of round shapes, seed %llu: error up to %.3f of the bound of spheres, %.3f of curves\n",
              static_cast<unsigned long long>(kSeed) + 1, static_cast<double>(worst_sphere),
              static_cast<double>(worst_curve));
}

TEST_CASE("closest points of a sphere: outside, inside, on the surface and at the center", "[primitives]") {
  const Sphere ball{{1, 2, 3}, 2};
  const CustomPoint out = of_sphere(ball, {6, 2, 3});
  CHECK((out.squared == 9.0 && out.point == Vec3D(3, 2, 3) && out.u == 1.0 && out.v == 0.5));
  const CustomPoint in = of_sphere(ball, {1, 2, 2.5});
  CHECK((in.squared == 2.25 && in.point == Vec3D(1, 2, 1)));
  CHECK(of_sphere(ball, {1, 4, 3}).squared == 0.0);
  const CustomPoint center = of_sphere(ball, {1, 2, 3});
  CHECK((center.squared == 4.0 && center.point == Vec3D(1, 2, 5) && center.u == 0.5 && center.v == 0.5));
  // 3, 4 and 12 are on the ball of radius 13. Rounding does not hide it.
  CHECK(of_sphere({{0, 0, 0}, 13}, {3, 4, 12}).squared == 0.0);
  CHECK(of_sphere({{0, 0, 0}, 0x1p-140f}, {0x1p-139, 0, 0}).squared == 0x1p-280);
  CHECK(of_sphere({{0, 0, 0}, 0x1p127f}, {0x1p120, 0, 0}).squared == 0x1.fcp126 * 0x1.fcp126);
}

TEST_CASE("what is never hit has no closest point", "[primitives]") {
  const Vec3D p(1, 2, 3);
  for (const float radius : {0.0f, -1.0f, kNan, kInfinity}) {
    CHECK(of_sphere({{0, 0, 0}, radius}, p).squared == std::numeric_limits<double>::infinity());
    if (radius == 0.0f) continue;
    CHECK(of_curve({{0, 0, 0}, radius}, {{1, 0, 0}, 1}, p).squared == std::numeric_limits<double>::infinity());
  }
  CHECK(of_sphere({{0, kNan, 0}, 1}, p).squared == std::numeric_limits<double>::infinity());
  CHECK(of_curve({{0, 0, 0}, 0}, {{1, 0, 0}, 0}, p).squared == std::numeric_limits<double>::infinity());
  CHECK(of_curve({{0, 0, 0}, 1}, {{1, 0, kInfinity}, 1}, p).squared == std::numeric_limits<double>::infinity());
}

TEST_CASE("closest points of curves: caps, mantle, axis, tips, and one ball in the other", "[primitives]") {
  const CurveVertex bottom{{0, 0, 0}, 1}, top{{0, 0, 4}, 1}, tip{{0, 0, 4}, 0};
  const CustomPoint side = of_curve(bottom, top, {3, 0, 1});
  CHECK((side.squared == 4.0 && side.point == Vec3D(1, 0, 1) && side.u == 0.25 && side.v == 0.0));
  CHECK(of_curve(bottom, top, {0, 0, -3}).point == Vec3D(0, 0, -1));
  CHECK(of_curve(bottom, top, {0, 0, 7}).point == Vec3D(0, 0, 5));
  const CustomPoint inside = of_curve(bottom, top, {0.25, 0, 2});
  CHECK((inside.squared == 0.5625 && inside.point == Vec3D(1, 0, 2)));
  const CustomPoint axis = of_curve(bottom, top, {0, 0, 3});  // Of a circle of closest points, always the same.
  CHECK((axis.squared == 1.0 && axis.point == Vec3D(0, 1, 3)));
  CHECK(of_curve(bottom, top, {0, 0, 0}).squared == 1.0);
  // The tip is a point of the surface, from ahead.
  const CustomPoint ahead = of_curve(bottom, tip, {0, 0, 9});
  CHECK((ahead.squared == 25.0 && ahead.point == Vec3D(0, 0, 4) && ahead.u == 1.0));
  CHECK(of_curve(bottom, tip, {0, 0, 4}).squared == 0.0);
  // A curve of one point, and a ball that holds the other, are balls.
  const CustomPoint held = of_curve({{0, 0, 0}, 3}, {{1, 0, 0}, 1}, {5, 0, 0});
  CHECK((held.squared == 4.0 && held.point == Vec3D(3, 0, 0) && held.u == 0.0));
  const CustomPoint one = of_curve(top, top, {0, 0, 4});
  CHECK((one.squared == 1.0 && one.point == Vec3D(0, 0, 5)));
}
