// The closest point of a triangle, against rationals: the bound of the distance, the point, the weights, and that
// neighbours agree on what they share.

#include <hiprt_device/intersect/point_triangle.h>
#include <tests/amount.h>
#include <tests/oracle/hill_climb.h>
#include <tests/oracle/point_triangle.h>

#include <tests/catch.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::oracle;
using hiprt::checks::trials;

namespace {

constexpr std::uint64_t kSeed = 20261127;
constexpr double kBound = 0x1p-43;  ///< docs/proofs/closest-points.md, in distances of the farthest corner.

struct Input {
  Vec3D corner[3], point;
};

/// @param genes three corners and a point.
Input input_of(const Genes& genes) {
  const auto at = [&](std::size_t i) { return Vec3D(genes[3 * i], genes[3 * i + 1], genes[3 * i + 2]); };
  return {{at(0), at(1), at(2)}, at(3)};
}
bool is_usable(const Genes& genes) {
  return std::all_of(genes.begin(), genes.end(), [](float x) { return std::isfinite(x); });
}
Rational3 exact3(const Vec3D& v) { return oracle::exact3(v.x, v.y, v.z); }
RationalCorners corners_of(const Input& input) {
  return {exact3(input.corner[0]), exact3(input.corner[1]), exact3(input.corner[2])};
}

/// |root(a) - root(b)|, where a is known as a double.
double root_difference(double a, const Rational& b) {
  const double sum = std::sqrt(a) + std::sqrt(b.get_d());
  return sum == 0.0 ? 0.0 : std::abs(Rational(Rational(a) - b).get_d()) / sum;
}

/// The error of the distance in bounds; -1: says nothing.
double distance_share(const Genes& genes) {
  if (!is_usable(genes)) return -1.0;
  const Input input = input_of(genes);
  const TrianglePoint near = closest_on_triangle(input.corner, input.point);
  const RationalCorners corners = corners_of(input);
  const Rational3 point = exact3(input.point);
  const double far = oracle::reach(point, corners);
  if (!(far > 0.0)) return near.squared == 0.0 ? 0.0 : 2.0;
  if (!std::isfinite(near.squared)) return 2.0;
  return root_difference(near.squared, squared_distance(point, corners)) / (kBound * far);
}

/// The distance of the reported point from the triangle, in bounds and in rounding of coordinates.
double point_share(const Genes& genes) {
  if (!is_usable(genes)) return -1.0;
  const Input input = input_of(genes);
  const TrianglePoint near = closest_on_triangle(input.corner, input.point);
  const RationalCorners corners = corners_of(input);
  double largest = max_component(input.point);
  for (const Vec3D& corner : input.corner) largest = std::max(largest, max_component(corner));
  const double bound = kBound * oracle::reach(exact3(input.point), corners) + 0x1p-51 * largest;
  return bound > 0.0 ? std::sqrt(squared_distance(exact3(near.point), corners).get_d()) / bound : 0.0;
}

Genes ordinary(Random& random) {
  Genes genes(12);
  for (float& x : genes) x = random.uniform_float(-1, 1);
  return genes;
}
/// Of all sizes, on a lattice, nearly in a line, and with the point near the triangle.
Genes odd(Random& random) {
  Genes genes = ordinary(random);
  const unsigned kind = random.below(5);
  for (float& x : genes) {
    if (kind == 0) x = static_cast<float>(random.below(7)) - 3.0f;
    if (kind == 1) x *= static_cast<float>(random.log_uniform(1e-30, 1e30));
  }
  if (kind >= 3) {
    const double share = random.unit(), off = random.log_uniform(1e-12, 1e-3);
    for (std::size_t k = 0; k < 3; ++k)
      genes[6 + k] = static_cast<float>(genes[k] + share * (genes[3 + k] - genes[k]) + off * random.uniform(-1, 1));
  }
  if (kind == 4) {
    const double share = random.unit(), off = random.log_uniform(1e-15, 1.0);
    for (std::size_t k = 0; k < 3; ++k)
      genes[9 + k] = static_cast<float>(genes[k] + share * (genes[6 + k] - genes[k]) + off * random.uniform(-1, 1));
  }
  const auto scale = random.coin() ? 1.0f : static_cast<float>(random.log_uniform(1e-35, 1e35));
  for (float& x : genes) x *= scale;
  return genes;
}

bool same(const TrianglePoint& a, const TrianglePoint& b) {
  return std::bit_cast<std::uint64_t>(a.squared) == std::bit_cast<std::uint64_t>(b.squared) && a.point == b.point;
}

}  // namespace

TEST_CASE("no search finds a larger error of the distance to a triangle than the bound") {
  for (const auto& make : {ordinary, odd}) {
    const Worst worst = climb(kSeed, trials(600), 300, make, distance_share);
    std::printf("distance to a triangle, seed %llu: random %.4f, search %.4f of the bound\n",
                static_cast<unsigned long long>(kSeed), worst.random, worst.score);
    REQUIRE(worst.score <= 1.0);
    REQUIRE(worst.score > 1e-6);  // The search has had something to judge.
  }
}

TEST_CASE("the closest point lies on its triangle") {
  for (const auto& make : {ordinary, odd}) {
    const Worst worst = climb(kSeed + 1, trials(300), 200, make, point_share);
    std::printf("closest point, seed %llu: random %.4f, search %.4f of the bound\n",
                static_cast<unsigned long long>(kSeed) + 1, worst.random, worst.score);
    REQUIRE(worst.score <= 1.0);
  }
}

TEST_CASE("the closest point does not depend on the order of corners, and its weights are the mesh's") {
  Random random(kSeed + 2);
  constexpr unsigned kOrders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  unsigned faces = 0, edges = 0, vertices = 0;
  for (unsigned i = 0; i < trials(60000); ++i) {
    const Input input = input_of(random.coin() ? ordinary(random) : odd(random));
    const TrianglePoint near = closest_on_triangle(input.corner, input.point);
    INFO("seed " << kSeed + 2 << ", case " << i);
    const double sum = near.u + near.v;
    REQUIRE((near.u >= 0 && near.v >= 0 && near.u <= 1 && near.v <= 1 && sum <= 1 + 1e-12));
    const auto feature = static_cast<unsigned>(near.feature);
    ++(feature == 0 ? faces : feature < 4 ? edges : vertices);
    const double weight[3] = {1 - sum, near.u, near.v};
    if (feature >= 4) REQUIRE((weight[feature - 4] == 1.0 && near.point == input.corner[feature - 4]));
    if (feature >= 1 && feature < 4) REQUIRE(std::abs(weight[(feature + 1) % 3]) <= 1e-15);
    for (const auto& order : kOrders) {
      const Vec3D turned[3] = {input.corner[order[0]], input.corner[order[1]], input.corner[order[2]]};
      REQUIRE(same(closest_on_triangle(turned, input.point), near));
    }
  }
  REQUIRE((faces > 100 && edges > 100 && vertices > 100));
}

/// Two triangles with the common edge from corner 0 to corner 1, or only corner 0, that fall off to both sides; and a
/// point above it.
std::pair<Input, Input> roof(Random& random, bool is_vertex) {
  const Double3 side = random.on_sphere(), up = random.on_sphere();
  const Position a = random.in_cube(1), b = random.in_cube(1);
  const double scale = random.log_uniform(1e-30, 1e30), share = random.unit(), height = random.log_uniform(1e-6, 10);
  const auto at = [&](double along, double aside, double above) {
    const auto k = [&](std::size_t i) {
      return double{static_cast<float>(scale * (a[i] + along * (b[i] - a[i]) + aside * side[i] + above * up[i]))};
    };
    return Vec3D(k(0), k(1), k(2));
  };
  const Vec3D point = is_vertex ? at(-share, 0, height) : at(share, 0, height);
  const Input one{{at(0, 0, 0), at(1, 0, 0), at(random.unit(), 1, -1)}, point};
  const Vec3D last = at(random.unit(), -random.unit(), -1);
  return {one, {{one.corner[0], is_vertex ? at(1, 0.1, -0.1) : one.corner[1], last}, point}};
}

TEST_CASE("triangles that share the closest edge or vertex have the same distance") {
  Random random(kSeed + 3);
  unsigned edges = 0, vertices = 0;
  for (unsigned i = 0; i < trials(60000); ++i) {
    const auto [one, other] = roof(random, random.coin());
    const TrianglePoint a = closest_on_triangle(one.corner, one.point),
                        b = closest_on_triangle(other.corner, one.point);
    INFO("seed " << kSeed + 3 << ", case " << i);
    if (a.feature != b.feature) continue;
    const bool is_edge = a.feature == TriangleFeature::kEdge0 && one.corner[1] == other.corner[1];
    if (!is_edge && a.feature != TriangleFeature::kVertex0) continue;
    ++(is_edge ? edges : vertices);
    REQUIRE(same(a, b));
  }
  REQUIRE((edges > trials(60000) / 20 && vertices > trials(60000) / 20));
}

TEST_CASE("a point beside a lattice edge is not taken for one inside: ties are exact") {
  // Right angles on integers: the exact decisions are known.
  const Vec3D left[3] = {{0, 0, 0}, {4, 0, 0}, {0, 3, 0}}, right[3] = {{0, 0, 0}, {0, -3, 0}, {4, 0, 0}};
  for (int x = 0; x <= 4; ++x)
    for (const double z : {0.0, 0.1, 1.0, 1e5, 1e-10}) {
      const Vec3D point(x, 0, z);
      const TrianglePoint a = closest_on_triangle(left, point), b = closest_on_triangle(right, point);
      REQUIRE(a.squared == z * z);
      INFO("x " << x << ", z " << z);
      REQUIRE(same(a, b));
      REQUIRE(a.feature == (x == 0   ? TriangleFeature::kVertex0
                            : x == 4 ? TriangleFeature::kVertex1
                                     : TriangleFeature::kEdge0));
    }
  const TrianglePoint inside = closest_on_triangle(left, {1, 1, -2});
  REQUIRE(inside.feature == TriangleFeature::kFace);
  REQUIRE(inside.squared == 4.0);
  REQUIRE((inside.point.x == 1.0 && inside.point.y == 1.0 && std::abs(inside.point.z) < 1e-15));
  REQUIRE((std::abs(inside.u - 0.25) < 1e-15 && std::abs(inside.v - 1.0 / 3.0) < 1e-15));
}

TEST_CASE("points exactly above a shared edge: no face counts, whatever rounds") {
  Random random(kSeed + 4);
  const auto whole = [&](std::uint32_t most) { return static_cast<double>(random.below(2 * most + 1)) - most; };
  const auto vector = [&](std::uint32_t most) { return Vec3D(whole(most), whole(most), whole(most)); };
  const auto cross = [](const Vec3D& a, const Vec3D& b) {
    return Vec3D(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
  };
  unsigned judged = 0;
  for (unsigned i = 0; i < trials(60000); ++i) {
    // Integers that floats hold. The edge and the first triangle are at right angles to up.
    const Vec3D up = vector(512), half = cross(up, vector(512)), aside = cross(up, half) / 1024.0;
    const Vec3D a = vector(1 << 22), b = a + 2.0 * half, point = a + half + (1.0 + random.below(4096)) * up;
    const auto rounded = [](const Vec3D& v) { return Vec3D(std::round(v.x), std::round(v.y), std::round(v.z)); };
    const Vec3D flat = a + cross(up, vector(512)), other = a - rounded(aside) - 300.0 * up;
    const Vec3D one[3] = {a, b, flat}, two[3] = {b, a, other};
    const TrianglePoint first = closest_on_triangle(one, point), second = closest_on_triangle(two, point);
    INFO("seed " << kSeed + 4 << ", case " << i);
    if (second.feature != TriangleFeature::kEdge0) continue;
    ++judged;
    REQUIRE(first.feature == TriangleFeature::kEdge0);
    REQUIRE(same(first, second));
  }
  REQUIRE(judged > trials(60000) / 10);
}

TEST_CASE("triangles without area: points and segments") {
  const Vec3D p(1, 2, 3), q(1, 2, 7), middle(1, 2, 5);
  for (const auto& corner : {std::array{p, p, p}, std::array{p, q, p}, std::array{p, q, middle}}) {
    const Vec3D corners[3] = {corner[0], corner[1], corner[2]};
    const TrianglePoint near = closest_on_triangle(corners, {4, 6, 3});
    REQUIRE((near.squared == 25.0 && near.point == p));
  }
  const Vec3D segment[3] = {p, q, middle};
  REQUIRE(closest_on_triangle(segment, {1, 5, 4}).squared == 9.0);
}

TEST_CASE("numbers that are not finite give no distance that is a number") {
  const Vec3D corners[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  for (const double odd : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    REQUIRE(!(closest_on_triangle(corners, {odd, 0, 0}).squared < std::numeric_limits<double>::infinity()));
}
