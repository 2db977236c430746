/// Triangles of polygons of any size, against a slow ear clipper.

#include <tests/tools/load.h>

#include <tests/oracle/random.h>
#include <tools/scene_io/mesh/polygons.h>

#include <numbers>

using namespace hiprt;
using namespace hiprt::test;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261127;

double area2(const build::Position& a, const build::Position& b, const build::Position& c) {
  return (double{b[0]} - a[0]) * (double{c[1]} - a[1]) - (double{b[1]} - a[1]) * (double{c[0]} - a[0]);
}

/// Clips the first ear until a triangle is left, as the text of Meisters' theorem says.
Triangles clip_slowly(const Positions& p) {
  std::vector<std::uint32_t> ring(p.size());
  for (std::uint32_t i = 0; i < ring.size(); ++i) ring[i] = i;
  Triangles result;
  const auto is_ear = [&](std::size_t i) {
    const std::size_t n = ring.size();
    const auto &a = p[ring[(i + n - 1) % n]], &b = p[ring[i]], &c = p[ring[(i + 1) % n]];
    if (area2(a, b, c) <= 0) return false;
    for (const std::uint32_t other : ring) {
      const auto& q = p[other];
      if (q == a || q == b || q == c) continue;
      if (area2(a, b, q) >= 0 && area2(b, c, q) >= 0 && area2(c, a, q) >= 0) return false;
    }
    return true;
  };
  while (ring.size() > 3) {
    std::size_t ear = 0;
    while (ear < ring.size() && !is_ear(ear)) ++ear;
    ear %= ring.size();
    const std::size_t n = ring.size();
    result.push_back({ring[(ear + n - 1) % n], ring[ear], ring[(ear + 1) % n]});
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  result.push_back({ring[0], ring[1], ring[2]});
  return result;
}

Triangles triangulate(const Positions& p) {
  tools::Polygons face;
  for (std::uint32_t i = 0; i < p.size(); ++i) face.corners.push_back(i);
  face.sizes = {static_cast<std::uint32_t>(p.size())};
  std::uint64_t skipped = 0;
  return *tools::triangulate(p, face, skipped);
}

build::Position polar(double angle, double radius) {
  return {static_cast<float>(radius * std::cos(angle)), static_cast<float>(radius * std::sin(angle)), 0};
}

/// A simple polygon: its corners in the order of their angles, at radii from least to 1.
Positions star(Random& random, std::size_t corners, double least) {
  Positions result;
  for (std::size_t i = 0; i < corners; ++i)
    result.push_back(polar(2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(corners),
                           random.uniform_float(least, 1)));
  return result;
}

/// A band of two spirals side by side: an edge of one sees far corners of the other.
Positions spiral(std::size_t half) {
  Positions outer, inner;
  for (std::size_t i = 0; i < half; ++i) {
    const double angle = 20 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(half);
    outer.push_back(polar(angle, 1 + angle));
    inner.push_back(polar(angle, 0.5 + angle));
  }
  outer.insert(outer.end(), inner.rbegin(), inner.rend());
  return outer;
}

/// Teeth of no width at their tips, along a line.
Positions comb(std::size_t teeth) {
  Positions result{{static_cast<float>(teeth), -1, 0}};
  for (std::size_t i = teeth; i > 0; --i) {
    result.push_back({static_cast<float>(i), 0, 0});
    result.push_back({static_cast<float>(i) - 0.5f, 5, 0});
  }
  result.push_back({0, 0, 0});
  result.push_back({0, -1, 0});
  return result;
}

/// Those become fans.
bool is_convex(const Positions& p) {
  for (std::size_t i = 0; i < p.size(); ++i)
    if (area2(p[i], p[(i + 1) % p.size()], p[(i + 2) % p.size()]) < 0) return false;
  return true;
}

double twice_area(const Positions& p) {
  double sum = 0;
  for (std::size_t i = 0; i < p.size(); ++i) sum += area2({0, 0, 0}, p[i], p[(i + 1) % p.size()]);
  return sum;
}

/// They cover the polygon and nothing twice: all look the same way, and their areas have the polygon's sum.
void check_cover(const Positions& p) {
  const Triangles triangles = triangulate(p);
  REQUIRE(triangles.size() == p.size() - 2);
  double sum = 0, least = 0;
  for (const auto& t : triangles) {
    const double area = area2(p[t[0]], p[t[1]], p[t[2]]);
    sum += area;
    least = std::min(least, area);
  }
  CHECK(least >= 0);
  CHECK(sum == Approx(twice_area(p)).epsilon(1e-9));
}

}  // namespace

TEST_CASE("Polygons: the triangles are those of the slow clipper, also where edges cross") {
  CAPTURE(kSeed);
  Random random(kSeed);
  for (unsigned round = 0; round < 60; ++round) {
    const std::size_t corners = 4 + random.below(120);
    const Positions p = star(random, corners, round % 2 == 0 ? 0.1 : 0.8);
    if (!is_convex(p)) CHECK(triangulate(p) == clip_slowly(p));
    // Every second corner anywhere on a coarse lattice: crossings, equal corners, corners on edges.
    Positions crossing = p;
    for (std::size_t i = 0; i < corners; i += 2)
      crossing[i] = {static_cast<float>(random.below(5)) - 2, static_cast<float>(random.below(5)) - 2, 0};
    if (twice_area(crossing) > 0 && !is_convex(crossing)) CHECK(triangulate(crossing) == clip_slowly(crossing));
  }
}

TEST_CASE("Polygons: large ones are covered") {
  CAPTURE(kSeed);
  Random random(kSeed);
  check_cover(star(random, 10'000, 0.3));
  check_cover(spiral(5'000));
  check_cover(comb(2'500));
  Positions point(20'000, build::Position{1, 2, 3});
  CHECK(triangulate(point).size() == 19'998);
}
