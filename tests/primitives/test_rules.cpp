// Rules of custom primitives: hits and misses, order, parameters, boxes, and equal bits everywhere.

#include <tests/primitives/digest.h>
#include <tests/primitives/measure.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20270315;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kLargest = std::numeric_limits<float>::max();

Ray ray_from(const Vec3& origin, const Vec3& direction, float tmin = 0.0f, float tmax = kInfinity) {
  return Ray{origin, tmin, direction, tmax};
}

std::vector<CustomHit> hits(const Case& c) {
  std::vector<CustomHit> result;
  CHECK(intersect(c, c.ray, [&](const CustomHit& hit) {
    result.push_back(hit);
    return true;
  }));
  return result;
}
std::vector<CustomHit> sphere_hits(const Sphere& s, const Ray& ray) {
  return hits({true, {{s.center[0], s.center[1], s.center[2]}, s.radius}, {}, ray});
}
std::vector<CustomHit> curve_hits(const CurveVertex& a, const CurveVertex& b, const Ray& ray) {
  return hits({false, a, b, ray});
}

void check_hit(const CustomHit& hit, float t, const Vec3& normal) {
  CHECK(hit.t == Approx(t).margin(1e-7));
  CHECK(hit.normal.x == Approx(normal.x).margin(1e-6));
  CHECK(hit.normal.y == Approx(normal.y).margin(1e-6));
  CHECK(hit.normal.z == Approx(normal.z).margin(1e-6));
}

constexpr Sphere kUnit{{0, 0, 0}, 1};
constexpr CurveVertex kBottom{{0, 0, 0}, 1}, kTop{{0, 0, 4}, 1}, kTip{{0, 0, 4}, 0};

}  // namespace

TEST_CASE("sphere: from outside, inside and behind, inclusive interval, order", "[primitives]") {
  const Vec3 z(0, 0, 1), from(0, 0, -3);
  const auto both = sphere_hits(kUnit, ray_from(from, z));
  REQUIRE(both.size() == 2);
  check_hit(both[0], 2, -z);
  check_hit(both[1], 4, z);
  CHECK(both[0].error > 0);
  CHECK(both[0].error < 1e-5f);
  REQUIRE(sphere_hits(kUnit, ray_from(Vec3(0), z)).size() == 1);
  check_hit(sphere_hits(kUnit, ray_from(Vec3(0), z))[0], 1, z);
  CHECK(sphere_hits(kUnit, ray_from(Vec3(0, 0, 3), z)).empty());
  CHECK(sphere_hits(kUnit, ray_from(Vec3(0, 0, -1), z)).size() == 2);  // From the surface: t = 0 counts.
  CHECK(sphere_hits(kUnit, ray_from(Vec3(0, 0, -1), -z)).size() == 1);
  CHECK(sphere_hits(kUnit, ray_from(from, z, 2, 4)).size() == 2);
  CHECK(sphere_hits(kUnit, ray_from(from, z, 0, std::nextafter(2.0f, 0.0f))).empty());
  CHECK(sphere_hits(kUnit, ray_from(from, z, std::nextafter(2.0f, 3.0f), 4)).size() == 1);
  CHECK(sphere_hits(kUnit, ray_from(from, z, std::nextafter(4.0f, 5.0f), kInfinity)).empty());
  CHECK(sphere_hits(kUnit, ray_from(from, z, 4, 2)).empty());
  CHECK(sphere_hits(kUnit, ray_from(from, z, kNan, 4)).empty());
  CHECK(sphere_hits(kUnit, ray_from(from, z, 0, kNan)).empty());
  CHECK(sphere_hits(kUnit, ray_from(-from, z, -10, 0)).size() == 2);
  check_hit(sphere_hits(kUnit, ray_from(from, z * 0x1p60f))[0], 0x1p-59f, -z);
}

TEST_CASE("a report that returns false ends the intersection", "[primitives]") {
  for (const bool is_sphere : {true, false}) {
    const Case c{is_sphere, kBottom, kTop, ray_from(Vec3(-3, 0, 0), Vec3(1, 0, 0))};
    int reports = 0;
    CHECK_FALSE(intersect(c, c.ray, [&](const CustomHit&) {
      ++reports;
      return false;
    }));
    CHECK(reports == 1);
  }
}

TEST_CASE("tangents are hit twice at one t; beyond the band they miss", "[primitives]") {
  const auto touching = sphere_hits(kUnit, ray_from(Vec3(1, 0, -3), Vec3(0, 0, 1)));
  REQUIRE(touching.size() == 2);
  check_hit(touching[0], 3, Vec3(1, 0, 0));
  check_hit(touching[1], 3, Vec3(1, 0, 0));
  CHECK(sphere_hits(kUnit, ray_from(Vec3(std::nextafter(1.0f, 2.0f), 0, -3), Vec3(0, 0, 1))).empty());
  const auto mantle = curve_hits(kBottom, kTop, ray_from(Vec3(-3, 1, 2), Vec3(1, 0, 0)));
  REQUIRE(mantle.size() == 2);
  check_hit(mantle[0], 3, Vec3(0, 1, 0));
  check_hit(mantle[1], 3, Vec3(0, 1, 0));
  CHECK(curve_hits(kBottom, kTop, ray_from(Vec3(-3, std::nextafter(1.0f, 2.0f), 2), Vec3(1, 0, 0))).empty());
}

TEST_CASE("curve: across, along, at seams and tips, held balls", "[primitives]") {
  const auto across = curve_hits(kBottom, kTop, ray_from(Vec3(-3, 0, 1), Vec3(1, 0, 0)));
  REQUIRE(across.size() == 2);
  check_hit(across[0], 2, Vec3(-1, 0, 0));
  check_hit(across[1], 4, Vec3(1, 0, 0));
  CHECK(across[0].u == 0.25f);
  CHECK(across[0].v == 0.0f);
  const auto along = curve_hits(kBottom, kTop, ray_from(Vec3(0, 0, 9), Vec3(0, 0, -2)));
  REQUIRE(along.size() == 2);
  check_hit(along[0], 2, Vec3(0, 0, 1));
  check_hit(along[1], 5, Vec3(0, 0, -1));
  CHECK(along[0].u == 1.0f);
  CHECK(along[1].u == 0.0f);
  const auto seam = curve_hits(kBottom, kTop, ray_from(Vec3(-3, 0, 0), Vec3(1, 0, 0)));
  REQUIRE(seam.size() == 2);
  check_hit(seam[0], 2, Vec3(-1, 0, 0));
  check_hit(seam[1], 4, Vec3(1, 0, 0));
  const auto tip = curve_hits(kBottom, kTip, ray_from(Vec3(0, 0, 9), Vec3(0, 0, -1)));
  REQUIRE(tip.size() == 2);
  check_hit(tip[0], 5, Vec3(0, 0, 1));
  CHECK(tip[0].u == 1.0f);
  CHECK(curve_hits(kTip, kBottom, ray_from(Vec3(0, 0, 9), Vec3(0, 0, -1)))[0].u == 0.0f);
  const CurveVertex small{{0, 0, 0.5f}, 0.25f};
  for (const auto& held : {curve_hits(kBottom, small, ray_from(Vec3(-3, 0, 0.5f), Vec3(1, 0, 0))),
                           sphere_hits(kUnit, ray_from(Vec3(-3, 0, 0.5f), Vec3(1, 0, 0)))}) {
    REQUIRE(held.size() == 2);
    check_hit(held[0], 3 - std::sqrt(0.75f), Vec3(-std::sqrt(0.75f), 0, 0.5f));
  }
  CHECK(curve_hits(kBottom, small, ray_from(Vec3(-3, 0, 0), Vec3(1, 0, 0)))[0].u == 0.0f);
  CHECK(curve_hits(small, kBottom, ray_from(Vec3(-3, 0, 0), Vec3(1, 0, 0)))[0].u == 1.0f);
  CHECK(curve_hits(kBottom, kBottom, ray_from(Vec3(-3, 0, 0), Vec3(1, 0, 0))).size() == 2);
}

TEST_CASE("primitives and rays that are not valid miss", "[primitives]") {
  const Ray ray = ray_from(Vec3(0, 0, -3), Vec3(0, 0, 1));
  const CurveVertex zero{{0, 0, 0}, 0};
  CHECK(sphere_hits({{0, 0, 0}, 0}, ray).empty());
  CHECK(curve_hits(zero, kTip, ray).empty());
  for (const float bad : {kNan, kInfinity, -kInfinity, -1.0f}) {
    CHECK(sphere_hits({{0, 0, 0}, bad}, ray).empty());
    CHECK(curve_hits({{0, 0, 0}, bad}, kTop, ray).empty());
    CHECK(curve_hits(kBottom, {{0, 0, 4}, bad}, ray).empty());
    if (bad == -1.0f) continue;
    for (int axis = 0; axis < 3; ++axis) {
      Sphere sphere = kUnit;
      CurveVertex vertex = kBottom;
      sphere.center[axis] = vertex.position[axis] = bad;
      CHECK(sphere_hits(sphere, ray).empty());
      CHECK(curve_hits(vertex, kTop, ray).empty());
      CHECK(curve_hits(kTop, vertex, ray).empty());
      Ray wrong = ray;
      wrong.origin[axis] = bad;
      CHECK(sphere_hits(kUnit, wrong).empty());
      CHECK(curve_hits(kBottom, kTop, wrong).empty());
      wrong = ray;
      wrong.direction[axis] = bad;
      CHECK(sphere_hits(kUnit, wrong).empty());
      CHECK(curve_hits(kBottom, kTop, wrong).empty());
    }
  }
  CHECK(sphere_hits(kUnit, ray_from(Vec3(0), Vec3(0))).empty());
  CHECK(curve_hits(kBottom, kTop, ray_from(Vec3(0), Vec3(0))).empty());
}

TEST_CASE("numbers of any bits: reported hits are in the interval and have no NaN", "[primitives]") {
  INFO("seed " << kSeed);
  Random random(kSeed);
  unsigned reported = 0;
  for (unsigned i = 0; i < trials(3000000); ++i) {
    Case c{random.coin(), {}, {}, {}};
    // Exponents alike, or nothing would ever be hit.
    const float scale = static_cast<float>(random.log_uniform(1e-38, 1e38));
    const bool any = random.below(4) == 0;
    const auto number = [&] { return any ? random.any_float() : scale * random.uniform_float(-1, 1); };
    for (CurveVertex* v : {&c.a, &c.b}) {
      for (float& p : v->position) p = number();
      v->radius = std::abs(number());
    }
    for (int k = 0; k < 3; ++k) c.ray.origin[k] = number(), c.ray.direction[k] = number();
    c.ray.tmin = random.coin() ? -kLargest : number();
    c.ray.tmax = random.coin() ? kInfinity : number();
    intersect(c, c.ray, [&](const CustomHit& hit) {
      ++reported;
      const bool fine = hit.t >= c.ray.tmin && hit.t <= c.ray.tmax && std::isfinite(hit.t) && hit.error > 0 &&
                        hit.u >= 0 && hit.u <= 1 && hit.v >= 0 && hit.v <= 1;
      const float normal = max_component(hit.normal);
      if (!(fine && normal > 0.0f && normal < kInfinity)) FAIL(describe(c) << " t " << hit.t);
      return true;
    });
  }
  CHECK(reported > trials(800000));
}

TEST_CASE("lines keep their position however far away their origin is", "[primitives]") {
  INFO("seed " << kSeed + 4);
  Random random(kSeed + 4);
  for (int i = 0; i < 20000; ++i) {
    // Across the x axis, exactly: the origin is a multiple of the direction away.
    const float radius = random.uniform_float(0.5, 1), dy = random.uniform_float(-1, 1),
                dz = random.uniform_float(-1, 1);
    const Sphere sphere{{0, 0, 0}, radius};
    const CurveVertex a{{0, 0, 0}, radius}, b{{-2, 0, 0}, 0.5f * radius};
    const float inside = std::nextafter(radius, 0.0f), outside = std::nextafter(radius, 2.0f);
    for (const float far : {0x1p20f, 0x1p35f, 0x1p45f}) {
      CAPTURE(radius, dy, dz, far);
      const Vec3 direction(0, dy, dz), from = -far * direction;
      REQUIRE(sphere_hits(sphere, ray_from(Vec3(inside, from.y, from.z), direction)).size() == 2);
      REQUIRE(sphere_hits(sphere, ray_from(Vec3(outside, from.y, from.z), direction)).empty());
      REQUIRE(curve_hits(a, b, ray_from(Vec3(inside, from.y, from.z), direction)).size() == 2);
      REQUIRE(curve_hits(a, b, ray_from(Vec3(outside, from.y, from.z), direction)).empty());
    }
  }
}

TEST_CASE("octahedral coordinates name the normal", "[primitives]") {
  INFO("seed " << kSeed + 1);
  Random random(kSeed + 1);
  for (int i = 0; i < 20000; ++i) {
    const Point n = random.on_sphere();
    const auto found = sphere_hits(kUnit, ray_from(Vec3(0), rounded(n)));
    REQUIRE(found.size() == 1);
    double x = 2.0 * found[0].u - 1, y = 2.0 * found[0].v - 1;
    const double z = 1 - std::abs(x) - std::abs(y);
    if (z < 0) {
      const double unfolded = std::copysign(1 - std::abs(y), x);
      y = std::copysign(1 - std::abs(x), y);
      x = unfolded;
    }
    const double length = std::sqrt(x * x + y * y + z * z);
    CAPTURE(n[0], n[1], n[2]);
    REQUIRE(std::abs(x / length - found[0].normal.x) < 1e-6);
    REQUIRE(std::abs(y / length - found[0].normal.y) < 1e-6);
    REQUIRE(std::abs(z / length - found[0].normal.z) < 1e-6);
  }
}

TEST_CASE("a reversed segment gives the same hits", "[primitives]") {
  INFO("seed " << kSeed + 2);
  Random random(kSeed + 2);
  unsigned compared = 0;
  for (int i = 0; i < 20000; ++i) {
    Case c = random_case(kShapes[2 + random.below(8)], kAims[random.below(8)], Scales{}, random);
    const auto before = hits(c);
    std::swap(c.a, c.b);
    const auto after = hits(c);
    INFO(describe(c));
    REQUIRE(before.size() == after.size());
    for (std::size_t k = 0; k < before.size(); ++k) {
      // Across the axis, neither end is the first.
      const LineAndBalls in = exact_terms(c);
      const Real slope = inner(real3(in.direction), minus(real3(in.p1), real3(in.p0)));
      if (slope == 0 || in.r0 == in.r1) continue;
      ++compared;
      REQUIRE(before[k].t == after[k].t);
      REQUIRE(before[k].normal == after[k].normal);
      REQUIRE(std::abs(before[k].u + after[k].u - 1) <= 0x1p-23f);
    }
  }
  CHECK(compared > 10000);
}

TEST_CASE("boxes contain their primitives exactly and are the smallest", "[primitives]") {
  INFO("seed " << kSeed + 3);
  Random random(kSeed + 3);
  for (int i = 0; i < 50000; ++i) {
    const double scale = random.log_uniform(1e-30, 1e30);
    const auto number = [&] { return static_cast<float>(scale * random.uniform(-1, 1) * random.log_uniform(1e-8, 1)); };
    CurveVertex vertex[2];
    for (CurveVertex& v : vertex) {
      for (float& p : v.position) p = random.below(8) == 0 ? 0.0f : number();
      v.radius = random.below(8) == 0 ? 0.0f : std::abs(number());
    }
    const Sphere sphere{{vertex[0].position[0], vertex[0].position[1], vertex[0].position[2]}, vertex[0].radius};
    if (sphere.radius == 0.0f || vertex[1].radius == 0.0f) continue;
    const Box ball = SphereSet::bounds(sphere), curve = RoundCurveSet::bounds(vertex[0], vertex[1]);
    for (int k = 0; k < 3; ++k) {
      const Rational low = exact(sphere.center[k]) - exact(sphere.radius),
                     high = exact(sphere.center[k]) + exact(sphere.radius);
      const Rational curve_low = std::min<Rational>(low, exact(vertex[1].position[k]) - exact(vertex[1].radius)),
                     curve_high = std::max<Rational>(high, exact(vertex[1].position[k]) + exact(vertex[1].radius));
      const auto fits = [](float side, const Rational& at, float inwards) {
        return inwards > 0 ? exact(side) <= at && exact(std::nextafter(side, inwards)) > at
                           : exact(side) >= at && exact(std::nextafter(side, inwards)) < at;
      };
      CAPTURE(sphere.center[k], sphere.radius, k);
      REQUIRE(fits(ball.min[k], low, kInfinity));
      REQUIRE(fits(ball.max[k], high, -kInfinity));
      REQUIRE(fits(curve.min[k], curve_low, kInfinity));
      REQUIRE(fits(curve.max[k], curve_high, -kInfinity));
    }
  }
  for (const Box& empty : {SphereSet::bounds({{0, 0, 0}, 0}), SphereSet::bounds({{0, kNan, 0}, 1}),
                           RoundCurveSet::bounds(kTip, kTip), RoundCurveSet::bounds(kBottom, {{0, 0, 0}, -1})})
    for (int k = 0; k < 3; ++k) CHECK((empty.min[k] == kInfinity && empty.max[k] == -kInfinity));
  CHECK(SphereSet::bounds({{kLargest, 0, 0}, kLargest}).max[0] == kInfinity);
}

TEST_CASE("the same bits with every compiler and processor", "[primitives]") {
  std::uint64_t digest = 0, points = 0;
  for (std::uint32_t i = 0; i < kDigestCases; ++i) {
    digest += digest_case(i);
    points += digest_points(i);
  }
  CHECK(digest == kDigest);
  CHECK(points == kPointDigest);
}
