// Mesh generators: closed where documented, around the origin, and equal for equal seeds.

#include <tests/oracle/brute_force.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/catch.h>

#include <cstring>

using namespace hiprt;
using namespace hiprt::oracle;

namespace {

/// Signed crossings of a ray with the exact surface; not for rays through edges.
int crossings(const Mesh& mesh, const Ray& ray) {
  int count = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    if (const Corners c = corners(mesh, i); decide(ray, c).hit) count += plane_sign(ray, c);
  return count;
}

bool same(const Mesh& a, const Mesh& b) {
  return a.triangles == b.triangles && a.positions.size() == b.positions.size() &&
         std::memcmp(a.positions.data(), b.positions.data(), a.positions.size() * sizeof(Position)) == 0;
}

}  // namespace

TEST_CASE("closed meshes are closed, oriented outwards and contain the origin", "[meshes]") {
  const std::vector<Mesh> meshes{
      icosphere(0), icosphere(3), star(3, 1), subdivided_box(1, 1.0, 2), subdivided_box(9, 2.5, 3), spindle(7, 5, 1e6)};
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    CAPTURE(i);
    CHECK(is_closed(meshes[i]));
    Random random(i);
    for (int k = 0; k < 50; ++k) {
      Ray ray;
      const Double3 d = random.on_sphere();
      ray.direction = vec3(rounded(d));
      CHECK(crossings(meshes[i], ray) == 1);
    }
  }
}

TEST_CASE("the torus is closed and contains its tube's centre", "[meshes]") {
  const Mesh mesh = torus(24, 12, 0.3);
  CHECK(is_closed(mesh));
  Ray ray;
  ray.origin = Vec3(1, 0, 0);
  ray.direction = Vec3(0.31f, 0.47f, 0.83f);
  CHECK(crossings(mesh, ray) == 1);
  ray.origin = Vec3(0);
  CHECK(crossings(mesh, ray) == 0);
}

TEST_CASE("sizes are as documented", "[meshes]") {
  CHECK(icosphere(4).triangles.size() == 20 * 256);
  CHECK(icosphere(4).positions.size() == 10 * 256 + 2);
  CHECK(torus(10, 6, 0.2).triangles.size() == 120);
  CHECK(subdivided_box(8, 2.0, 1).triangles.size() == 6 * 64 * 2);
  CHECK(subdivided_box(8, 2.0, 1).positions.size() == 6 * 64 + 2);
  CHECK(grid_plane(5, 1, 3.0f).triangles.size() == 50);
  for (const Position& p : grid_plane(5, 1, 3.0f).positions) CHECK(p[1] == 3.0f);
  CHECK(soup(17, 0.1, 1).triangles.size() == 17);
  CHECK(identical(5).triangles.size() == 5);
}

TEST_CASE("needles are as thin as requested", "[meshes]") {
  const Mesh mesh = needles(200, 1e6, 5);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Corners c = corners(mesh, i);
    const auto length = [](const Position& a, const Position& b) {
      return std::hypot(double{b[0]} - a[0], double{b[1]} - a[1], double{b[2]} - a[2]);
    };
    const double longest = length(c.p0, c.p1), a = length(c.p1, c.p2), b = length(c.p2, c.p0),
                 s = (longest + a + b) / 2;
    const double area = std::sqrt(std::max(0.0, s * (s - longest) * (s - a) * (s - b)));
    CHECK(2 * area / longest < 2e-6);
    CHECK(longest > 0.4);
  }
}

TEST_CASE("one seed, one mesh", "[meshes]") {
  CHECK(same(star(2, 7), star(2, 7)));
  CHECK_FALSE(same(star(2, 7), star(2, 8)));
  CHECK(same(torture(300, 7), torture(300, 7)));
  CHECK(same(needles(30, 1e7, 7), needles(30, 1e7, 7)));
  CHECK_FALSE(same(subdivided_box(5, 2, 7), subdivided_box(5, 2, 8)));
}

TEST_CASE("the torture set contains every kind of triangle", "[meshes]") {
  const Mesh mesh = torture(2000, 3);
  int not_finite = 0, repeated = 0, denormal = 0, huge = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Corners c = corners(mesh, i);
    if (!is_finite(c)) {
      ++not_finite;
      continue;
    }
    repeated += c.p0 == c.p1 || c.p1 == c.p2 || c.p2 == c.p0 ? 1 : 0;
    const float size = std::max({std::abs(c.p0[0]), std::abs(c.p0[1]), std::abs(c.p0[2])});
    denormal += size > 0 && size < std::numeric_limits<float>::min() ? 1 : 0;
    huge += size > 1e17f ? 1 : 0;
  }
  CHECK(not_finite > 300);
  CHECK(repeated > 100);
  CHECK(denormal > 50);
  CHECK(huge > 100);
}

TEST_CASE("placing rounds once and keeps connectivity", "[meshes]") {
  const Mesh mesh = icosphere(2), far = placed(mesh, 10, {148376, 1234, -223423});
  CHECK(is_closed(far));
  CHECK(far.positions[0][0] == static_cast<float>(double{mesh.positions[0][0]} * 10 + 148376));
}
