// The exact oracle against known values, against an integer-only version, and against a second formulation.

#include <tests/oracle/brute_force.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/oracle/ray_box.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::oracle;

namespace {

constexpr std::uint64_t kSeed = 20261121;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

Ray make_ray(const Position& o, const Position& d, float tmin = 0.0f, float tmax = kInfinity) {
  return Ray{vec3(o), tmin, vec3(d), tmax};
}

/// Moeller & Trumbore's formulation in rationals; false where its determinant is 0.
bool moeller_trumbore(const Ray& ray, const Corners& c, ExactPoint& out) {
  using R3 = std::array<Rational, 3>;
  const auto lift = [](const Position& p) { return R3{exact(p[0]), exact(p[1]), exact(p[2])}; };
  const auto sub = [](const R3& a, const R3& b) { return R3{a[0] - b[0], a[1] - b[1], a[2] - b[2]}; };
  const auto dot3 = [](const R3& a, const R3& b) { return Rational(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]); };
  const auto cross3 = [](const R3& a, const R3& b) {
    return R3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const R3 o = lift(position(ray.origin)), d = lift(position(ray.direction)), p0 = lift(c.p0);
  const R3 e1 = sub(lift(c.p1), p0), e2 = sub(lift(c.p2), p0), p = cross3(d, e2);
  const Rational determinant = dot3(e1, p);
  if (sgn(determinant) == 0) return false;
  const R3 s = sub(o, p0), q = cross3(s, e1);
  out = {dot3(e2, q) / determinant, dot3(s, p) / determinant, dot3(d, q) / determinant};
  return true;
}

bool inside(const ExactPoint& point, const Ray& ray) {
  return point.u >= 0 && point.v >= 0 && point.u + point.v <= 1 && point.t >= exact(effective_tmin(ray)) &&
         (!std::isfinite(ray.tmax) || point.t <= exact(ray.tmax));
}

/// Rays and triangles on a small integer lattice meet in every degenerate way; others are of any scale.
std::pair<Ray, Corners> random_case(Random& random) {
  const auto lattice = [&] { return static_cast<float>(random.below(7)) - 3.0f; };
  const auto wild = [&] {
    return static_cast<float>(random.log_uniform(1e-30, 1e30)) * (random.coin() ? 1.0f : -1.0f);
  };
  const unsigned kind = random.below(3);
  const auto number = [&] { return kind == 0 ? lattice() : kind == 1 ? wild() : random.uniform_float(-1, 1); };
  const auto point = [&] { return Position{number(), number(), number()}; };
  Ray ray = make_ray(point(), point());
  if (random.coin()) ray.tmin = std::abs(number());
  if (random.coin()) ray.tmax = std::abs(number()) + ray.tmin;
  Corners corners{point(), point(), point()};
  if (kind == 2) {  // Aimed at a point of an edge, rounded: as near to the boundary as floats come.
    const double s = random.unit();
    for (int k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      ray.direction[k] = static_cast<float>(corners.p0[i] + s * (corners.p1[i] - corners.p0[i]) - ray.origin[k]);
    }
  }
  return {ray, corners};
}

}  // namespace

TEST_CASE("floats are integers times 2^-149", "[oracle]") {
  CHECK(scaled(0.0f) == 0);
  CHECK(scaled(-0.0f) == 0);
  CHECK(scaled(std::numeric_limits<float>::denorm_min()) == 1);
  CHECK(scaled(-1.0f) == -(Integer(1) << 149));
  CHECK(scaled(std::numeric_limits<float>::max()) == ((Integer(1) << 24) - 1) << (149 + 104));
}

TEST_CASE("nearest_float rounds as IEEE 754 does", "[oracle]") {
  CHECK(nearest_float(Rational(1, 3)) == 1.0f / 3.0f);
  CHECK(nearest_float(Rational(-2, 3)) == -2.0f / 3.0f);
  CHECK(nearest_float(Rational((1 << 24) + 1)) == 0x1p24f);      // A tie, to even.
  CHECK(nearest_float(Rational((1 << 24) + 3)) == 0x1p24f + 4);  // A tie, to even.
  CHECK(nearest_float(exact(0x1p-149f) / 2) == 0.0f);
  CHECK(nearest_float(exact(0x1p-149f) * 3 / 4) == 0x1p-149f);
  const Rational largest = exact(std::numeric_limits<float>::max());
  CHECK(nearest_float(largest * Rational(1000001, 1000000)) == kInfinity);
  CHECK(nearest_float(largest + 1) == std::numeric_limits<float>::max());
  CHECK(nearest_float(-largest * 2) == -kInfinity);
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    // Quotients of floats: the processor's division is correctly rounded.
    const float a = random.any_float(), b = random.any_float();
    if (!std::isfinite(a) || !std::isfinite(b) || b == 0.0f) continue;
    CAPTURE(a, b);
    REQUIRE(nearest_float(Rational(exact(a) / exact(b))) == a / b);
  }
}

TEST_CASE("ulps are counted at the given magnitude", "[oracle]") {
  CHECK(ulp(1.0) == 0x1p-23);
  CHECK(ulp(1.99) == 0x1p-23);
  CHECK(ulp(-2.0) == 0x1p-22);
  CHECK(ulp(0.0) == 0x1p-149);
  CHECK(ulp(1e-44) == 0x1p-149);
  CHECK(error_in_ulps(1.0f + 0x1p-23f, Rational(1)) == 1.0);
  CHECK(error_in_ulps(1.0f, Rational(1) + Rational(1, 1 << 24)) == 0.5);
  CHECK(error_in_ulps(1.0f, Rational(3), 1024.0) == 2.0 / 0x1p-13);
}

TEST_CASE("closed triangle: corners, edges, inside, outside, parallel", "[oracle]") {
  const Corners c{{0, 0, 2}, {4, 0, 2}, {0, 4, 2}};
  const auto hit = [&](float x, float y) { return decide(make_ray({x, y, 0}, {0, 0, 1}), c).hit; };
  CHECK(hit(1, 1));
  CHECK(hit(0, 0));
  CHECK(hit(4, 0));
  CHECK(hit(0, 4));
  CHECK(hit(2, 0));
  CHECK(hit(2, 2));
  CHECK_FALSE(hit(std::nextafter(2.0f, 3.0f), 2));
  CHECK_FALSE(hit(-0x1p-149f, 1));
  CHECK_FALSE(hit(5, 5));
  CHECK_FALSE(decide(make_ray({1, 1, 2}, {1, 0, 0}), c).hit);   // In the plane.
  CHECK_FALSE(decide(make_ray({1, 1, 0}, {1, 0, 0}), c).hit);   // Beside it.
  CHECK_FALSE(decide(make_ray({1, 1, 0}, {0, 0, -1}), c).hit);  // Behind.
  CHECK(decide(make_ray({1, 1, 2}, {0, 0, -1}), c).hit);        // tmin = 0 on the surface.
  CHECK(decide(make_ray({1, 1, 0}, {0, 0, 0.5f}, 4, 4), c).hit);
  CHECK_FALSE(decide(make_ray({1, 1, 0}, {0, 0, 0.5f}, 0, std::nextafter(4.0f, 0.0f)), c).hit);
  CHECK_FALSE(decide(make_ray({1, 1, 0}, {0, 0, 0.5f}, std::nextafter(4.0f, 5.0f)), c).hit);
  CHECK_FALSE(decide(make_ray({1, 1, 0}, {0, 0, 1}), {{0, 0, 2}, {1, 1, 2}, {2, 2, 2}}).hit);  // No area.
  const ExactPoint point = exact_point(make_ray({1, 2, 0}, {0, 0, 3}), c);
  CHECK(point.t == Rational(2, 3));
  CHECK(point.u == Rational(1, 4));
  CHECK(point.v == Rational(1, 2));
}

TEST_CASE("filtered, integer and Moeller-Trumbore decisions agree", "[oracle]") {
  INFO("seed " << kSeed);
  Random random(kSeed);
  int hits = 0, undecided = 0;
  for (int i = 0; i < 60000; ++i) {
    const auto [ray, corners] = random_case(random);
    if (!is_valid(ray)) continue;
    const FilteredHit filtered = decide(ray, corners), integers = decide_in_integers(ray, corners);
    CAPTURE(i);
    REQUIRE(filtered.hit == integers.hit);
    ExactPoint second{};
    const bool crosses = moeller_trumbore(ray, corners, second);
    REQUIRE(crosses == (plane_sign(ray, corners) != 0));
    REQUIRE(filtered.hit == (crosses && inside(second, ray)));
    if (!crosses) continue;
    const ExactPoint first = exact_point(ray, corners);
    REQUIRE((first.t == second.t && first.u == second.u && first.v == second.v));
    hits += filtered.hit ? 1 : 0;
    undecided += first.u == 0 || first.v == 0 || first.u + first.v == 1 ? 1 : 0;
    if (filtered.hit) REQUIRE(abs(Rational(filtered.t) - first.t) <= Rational(filtered.t_error));
  }
  CHECK(hits > 3000);
  CHECK(undecided > 1000);  // Rays exactly through edges were among them.
}

TEST_CASE("rotating or mirroring the corners changes no decision", "[oracle]") {
  INFO("seed " << kSeed + 1);
  Random random(kSeed + 1);
  for (int i = 0; i < 20000; ++i) {
    const auto [ray, c] = random_case(random);
    if (!is_valid(ray)) continue;
    CAPTURE(i);
    const bool hit = decide(ray, c).hit;
    for (const Corners& other : {Corners{c.p1, c.p2, c.p0}, Corners{c.p2, c.p0, c.p1}, Corners{c.p1, c.p0, c.p2},
                                 Corners{c.p0, c.p2, c.p1}, Corners{c.p2, c.p1, c.p0}})
      REQUIRE(decide(ray, other).hit == hit);
    if (plane_sign(ray, c) == 0) continue;
    const ExactPoint p = exact_point(ray, c), q = exact_point(ray, {c.p1, c.p2, c.p0});
    REQUIRE(p.t == q.t);
    REQUIRE(q.u == p.v);
    REQUIRE(q.v == 1 - p.u - p.v);
    const Position o = position(ray.origin), d = position(ray.direction);
    REQUIRE(edge_sign(o, d, c.p0, c.p1) == edge_sign_exact(o, d, c.p0, c.p1));
    REQUIRE(edge_sign(o, d, c.p0, c.p1) == -edge_sign(o, d, c.p1, c.p0));
  }
}

TEST_CASE("invalid rays are recognised", "[oracle]") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK(is_valid(make_ray({0, 0, 0}, {0, 0, 1})));
  CHECK(is_valid(make_ray({0, 0, 0}, {0, 0, 0x1p-149f}, -1, 0)));
  CHECK_FALSE(is_valid(make_ray({nan, 0, 0}, {0, 0, 1})));
  CHECK_FALSE(is_valid(make_ray({0, kInfinity, 0}, {0, 0, 1})));
  CHECK_FALSE(is_valid(make_ray({0, 0, 0}, {0, 0, nan})));
  CHECK_FALSE(is_valid(make_ray({0, 0, 0}, {0, -0.0f, 0})));
  CHECK_FALSE(is_valid(make_ray({0, 0, 0}, {0, 0, 1}, nan)));
  CHECK_FALSE(is_valid(make_ray({0, 0, 0}, {0, 0, 1}, 0, nan)));
  CHECK_FALSE(is_valid(make_ray({0, 0, 0}, {0, 0, 1}, 2, 1)));
  CHECK_FALSE(is_valid(make_ray({0, 0, 0}, {0, 0, 1}, -2, -1)));
}

TEST_CASE("closed box: corners, edges, faces, zero components", "[oracle]") {
  const Box box{{0, 0, 0}, {1, 1, 1}};
  CHECK(touches(make_ray({-1, 0, 0}, {1, 0, 0}), box));  // Along an edge.
  CHECK(touches(make_ray({-1, 1, -0.0f}, {1, -0.0f, 0}), box));
  CHECK(touches(make_ray({-1, -1, 0}, {1, 1, 0}), box));  // Through a corner, in a face's plane.
  CHECK(touches(make_ray({2, 1, 0}, {-1, -1, 1}), box) == touches_exact(make_ray({2, 1, 0}, {-1, -1, 1}), box));
  CHECK(touches(make_ray({-1, 0, 0.5f}, {1, 1, 0}), box));  // Touches the edge x = 0, y = 1.
  CHECK_FALSE(touches(make_ray({-1, 0x1p-149f, 0.5f}, {1, 1, 0}), box));
  CHECK_FALSE(touches(make_ray({-1, std::nextafter(1.0f, 2.0f), 0}, {1, 0, 0}), box));
  CHECK(touches(make_ray({-1, 0, 0}, {1, 0, 0}, 0, 1), box));  // tmax exactly on the face.
  CHECK_FALSE(touches(make_ray({-1, 0, 0}, {1, 0, 0}, 0, std::nextafter(1.0f, 0.0f)), box));
  CHECK(touches(make_ray({-1, 0, 0}, {1, 0, 0}, 2, 3), box));
  CHECK_FALSE(touches(make_ray({-1, 0, 0}, {1, 0, 0}, std::nextafter(2.0f, 3.0f), 3), box));
  CHECK(touches(make_ray({0.5f, 0.5f, 0.5f}, {0, 0, 1}, 0, 0), box));
  CHECK_FALSE(touches(make_ray({0, 0, 0}, {0, 0, 1}), Box{{1, 1, 1}, {0, 0, 0}}));
}

TEST_CASE("filtered and rational box decisions agree; a hit triangle's box is touched", "[oracle]") {
  INFO("seed " << kSeed + 2);
  Random random(kSeed + 2);
  int touched = 0;
  for (int i = 0; i < 40000; ++i) {
    const auto [ray, c] = random_case(random);
    if (!is_valid(ray)) continue;
    Box box{};
    for (std::size_t k = 0; k < 3; ++k) {
      box.min[k] = std::min({c.p0[k], c.p1[k], c.p2[k]});
      box.max[k] = std::max({c.p0[k], c.p1[k], c.p2[k]});
    }
    CAPTURE(i);
    const bool result = touches(ray, box);
    touched += result ? 1 : 0;
    REQUIRE(result == touches_exact(ray, box));
    if (decide(ray, c).hit) REQUIRE(result);
  }
  CHECK(touched > 1000);
}

TEST_CASE("brute force keeps the tie rule and skips what is masked or not finite", "[oracle]") {
  const Ray down = make_ray({0, 0, 5}, {0, 0, -1});
  std::vector<Mesh> meshes{identical(3), identical(2)};
  CHECK(closest(meshes, down).geometry == 0);
  CHECK(closest(meshes, down).primitive == 0);
  meshes[0].mask = 2;
  Ray masked = down;
  masked.mask = 1;
  CHECK(closest(meshes, masked).geometry == 1);
  masked.mask = 0;
  CHECK_FALSE(closest(meshes, masked).found);
  // A nearer triangle by one unit in the last place wins, whatever its number.
  Mesh near = identical(1);
  for (Position& p : near.positions) p[2] = 0x1p-149f;
  meshes.push_back(near);
  CHECK(closest(meshes, down).geometry == 2);
  meshes[2].positions[0][0] = std::numeric_limits<float>::quiet_NaN();
  CHECK(closest(meshes, down).geometry == 0);
}
