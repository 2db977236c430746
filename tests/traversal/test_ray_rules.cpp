// The rules of ray.h: ranges, masks, directions, non-finite values, ids.

#include <hiprt_device/math/vec_functions.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/scenes.h>
#include <tests/traversal/tracers.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kLargest = std::numeric_limits<float>::max();
/// Relative error that t may have where the surface is at right angles to the ray.
constexpr float kTolerance = 0x1p-21f;

Ray make_ray(const Vec3& o, const Vec3& d, float tmin = 0.0f, float tmax = kInfinity) { return Ray{o, tmin, d, tmax}; }

/// The hit of all scenes and tracers, which must be one and the same, and any hit must agree.
Hit one_hit(const std::vector<Scene>& scenes, const Ray& ray) {
  const Hit hit = default_tracer().closest(scenes[0], ray);
  INFO(describe(ray) << "\n" << describe(hit));
  REQUIRE(find_difference(scenes, ray, hit) == "");
  for (const Scene& scene : scenes)
    for (const Tracer& tracer : default_tracers()) REQUIRE(tracer.any(scene, ray).found() == hit.found());
  return hit;
}

/// Squares in the planes z = 1, 2, 4 with corners at +-1, one geometry each.
std::vector<Mesh> shelves() { return {grid_plane(3, 2, 1), grid_plane(3, 2, 2), grid_plane(3, 2, 4)}; }

}  // namespace

TEST_CASE("a distance that no float can hold is a miss", "[ray]") {
  const std::vector<Scene> scenes = all_scenes(shelves());
  for (const float length : {1e-36f, 3e-38f, 1e-40f, 1e-45f}) {
    const Hit hit = one_hit(scenes, make_ray(Vec3(0.1f, 0.2f, 1000), Vec3(0, 0, -length)));
    CHECK_FALSE(hit.found());
    CHECK(hit.t == kInfinity);
  }
  for (const Tracer& tracer : all_tracers())
    for (const Scene& scene : scenes)
      for (const float length : {1e-36f, 3e-38f}) {
        const Ray ray = make_ray(Vec3(0.1f, 0.2f, 1000), Vec3(0, 0, -length));
        CHECK_FALSE(tracer.closest(scene, ray).found());
        CHECK_FALSE(tracer.any(scene, ray).found());
      }
}

TEST_CASE("normals are cross products, times a power of two where a float could not hold them", "[ray]") {
  for (const float size : {0x1p-140f, 0x1p-100f, 0x1p-60f, 1.0f, 0x1p60f, 0x1p100f}) {
    const Mesh mesh{{{0, 0, 0}, {size, 0, 0}, {0, 3 * size, 0}}, {{0, 1, 2}}};
    const Scene scene = make_scene({mesh});
    const Ray ray = make_ray(Vec3(0.25f * size, 0.5f * size, size), Vec3(0, 0, -size));
    const Hit hit = default_tracer().closest(scene, ray);
    CAPTURE(size);
    if (size >= 0x1p-100f && size <= 0x1p60f) REQUIRE(hit.found());
    if (!hit.found()) continue;
    CHECK((hit.normal.x == 0 && hit.normal.y == 0));
    CHECK((hit.normal.z >= 0x1p-100f && hit.normal.z <= kLargest));
    int exponent = 0;
    CHECK(std::frexp(hit.normal.z, &exponent) == 0.75f);
    if (size == 1.0f) CHECK(hit.normal.z == 3.0f);
    if (size == 0x1p60f) CHECK(hit.normal.z == 3.0f * 0x1p120f);
  }
}

TEST_CASE("tmin and tmax belong to the ray", "[ray]") {
  const std::vector<Scene> scenes = all_scenes(shelves());
  const auto t = [&](float tmin, float tmax) {
    return one_hit(scenes, make_ray(Vec3(0.1f, 0.2f, 0), Vec3(0, 0, 1), tmin, tmax)).t;
  };
  // The shelves' distances as traced: 1, 2, 4 with the rounding that hits may have.
  const float first = t(0, kInfinity), second = t(1.5f, kInfinity), third = t(3, kInfinity);
  CHECK(first == Approx(1).epsilon(kTolerance));
  CHECK(second == Approx(2).epsilon(kTolerance));
  CHECK(third == Approx(4).epsilon(kTolerance));
  CHECK(t(first, kInfinity) == first);
  CHECK(t(std::nextafter(first, 2.0f), kInfinity) == second);
  CHECK(t(0, first) == first);
  CHECK(t(0, std::nextafter(first, 0.0f)) == kInfinity);
  CHECK(t(second, second) == second);
  CHECK(t(third, third) == third);
  CHECK(t(2.5f, 2.5f) == kInfinity);
  CHECK(t(1.5f, 2.5f) == second);
  CHECK(t(3, kLargest) == third);
  CHECK(t(std::nextafter(third, 5.0f), kInfinity) == kInfinity);
  CHECK(t(second, first) == kInfinity);  // tmin > tmax
  CHECK(t(kLargest, kInfinity) == kInfinity);
  CHECK(t(-5, kInfinity) == first);  // Negative tmin counts as 0.
  CHECK(t(-5, -1) == kInfinity);
  CHECK(t(-0.0f, kInfinity) == first);
  CHECK(t(0, 0) == kInfinity);
  CHECK(t(0, -0.0f) == kInfinity);
}

TEST_CASE("tmin = 0 on the surface hits it; nothing behind the origin is hit", "[ray]") {
  const std::vector<Scene> scenes = all_scenes(shelves());
  for (const float z : {1.0f, 2.0f, 4.0f})
    for (const float side : {1.0f, -1.0f}) {
      const Hit hit = one_hit(scenes, make_ray(Vec3(0.1f, 0.2f, z), Vec3(0, 0, side)));
      CHECK(hit.t == 0);
      CHECK(hit.geometry == static_cast<std::uint32_t>(z) / 2);
      CHECK(one_hit(scenes, make_ray(Vec3(0.1f, 0.2f, z), Vec3(0, 0, side), 0, 0)).t == 0);
    }
  CHECK_FALSE(one_hit(scenes, make_ray(Vec3(0.1f, 0.2f, 0), Vec3(0, 0, -1))).found());
  CHECK_FALSE(one_hit(scenes, make_ray(Vec3(0.1f, 0.2f, 4.5f), Vec3(0, 0, 1))).found());
}

TEST_CASE("a hit's own t works as tmin, as tmax, and as both", "[ray]") {
  const std::vector<Mesh> meshes{star(3, 21)};
  const std::vector<Scene> scenes = all_scenes(meshes);
  Random random(22);
  for (int i = 0; i < 500; ++i) {
    const Vec3 o = vec3(random.in_cube(1.5)), to = vec3(random.in_cube(0.3));
    const Hit hit = one_hit(scenes, make_ray(o, to - o));
    if (!hit.found()) continue;
    for (const Ray& ray :
         {make_ray(o, to - o, 0, hit.t), make_ray(o, to - o, hit.t), make_ray(o, to - o, hit.t, hit.t)}) {
      const Hit again = one_hit(scenes, ray);
      INFO(describe(ray));
      REQUIRE(same_hit(again, hit));
    }
    const Hit beyond = one_hit(scenes, make_ray(o, to - o, std::nextafter(hit.t, kInfinity)));
    REQUIRE(!(beyond.t <= hit.t));
    REQUIRE_FALSE(one_hit(scenes, make_ray(o, to - o, 0, std::nextafter(hit.t, -1.0f))).found());
  }
}

TEST_CASE("invalid rays miss and terminate", "[ray]") {
  const std::vector<Mesh> meshes{icosphere(3)};
  const std::vector<Scene> scenes = all_scenes(meshes);
  const Ray good = make_ray(Vec3(0.1f, 0.2f, 0.3f), Vec3(0.3f, 0.5f, 0.7f), 0, 1e9f);
  REQUIRE(one_hit(scenes, good).found());
  for (const float bad : {kNan, -kNan, kInfinity, -kInfinity}) {
    for (int k = 0; k < 3; ++k) {
      Ray origin = good, direction = good;
      origin.origin[k] = bad;
      direction.direction[k] = bad;
      CHECK_FALSE(one_hit(scenes, origin).found());
      CHECK_FALSE(one_hit(scenes, direction).found());
    }
    Ray tmin = good;
    tmin.tmin = bad;
    CHECK_FALSE(one_hit(scenes, tmin).found());
    if (bad == kInfinity) continue;
    Ray tmax = good;
    tmax.tmax = bad;
    CHECK_FALSE(one_hit(scenes, tmax).found());
  }
  for (unsigned signs = 0; signs < 8; ++signs) {
    const auto zero = [&](unsigned k) { return (signs >> k & 1u) != 0 ? -0.0f : 0.0f; };
    CHECK_FALSE(one_hit(scenes, make_ray(good.origin, Vec3(zero(0), zero(1), zero(2)))).found());
  }
}

namespace {

/// cross(p1 - p0, p2 - p0) to a few units in the last place, times a power of two only where ray.h says so.
bool is_normal_of(const Vec3& normal, const Corners& c) {
  std::array<Rational, 3> a, b, cross;
  for (std::size_t k = 0; k < 3; ++k) a[k] = exact(c.p1[k]) - exact(c.p0[k]), b[k] = exact(c.p2[k]) - exact(c.p0[k]);
  Rational largest, largest_found;
  for (std::size_t k = 0; k < 3; ++k) {
    cross[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    largest = std::max(largest, Rational(abs(cross[k])));
    if (!std::isfinite(normal[static_cast<int>(k)])) return false;
    largest_found = std::max(largest_found, Rational(abs(exact(normal[static_cast<int>(k)]))));
  }
  if (sgn(largest) == 0) return sgn(largest_found) == 0;
  if (sgn(largest_found) == 0) return false;
  int exponent = 0;
  const double ratio = Rational(largest_found / largest).get_d();
  const double off_power = std::abs(std::frexp(ratio * (1 + 0x1p-21), &exponent) - 0.5);
  if (off_power > 0x1p-20) return false;
  const bool fits = largest >= exact(0x1p-100f) && largest < exact(0x1p127f);
  if (fits && exponent != 1) return false;
  for (std::size_t k = 0; k < 3; ++k) {
    const Rational off = abs(Rational(exact(normal[static_cast<int>(k)]) / largest_found - cross[k] / largest));
    if (off > exact(0x1p-20f)) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("rays of random bits terminate and report only valid hits", "[ray]") {
  constexpr std::uint64_t kSeed = 32;
  INFO("seed " << kSeed);
  const std::vector<Mesh> meshes{torture(400, 31), icosphere(2)};
  const std::vector<Scene> scenes = all_scenes(meshes);
  Random random(kSeed);
  std::uint64_t hits = 0;
  for (int i = 0; i < 2000; ++i) {
    Ray ray;
    // One in three starts in the ball, and one is aimed at any triangle, as large as it may be, from its other side: of
    // the others hardly one meets anything.
    const int kind = i % 3;
    const Corners target = corners(meshes[0], random.below(static_cast<std::uint32_t>(meshes[0].triangles.size())));
    for (int k = 0; k < 3; ++k) {
      const auto axis = static_cast<std::size_t>(k);
      ray.origin[k] = kind == 0 ? random.uniform_float(-0.5, 0.5) : kind == 1 ? -target.p0[axis] : random.any_float();
      ray.direction[k] = random.any_float();
      if (kind == 1) ray.direction[k] = 0.5f * target.p0[axis] + 0.25f * target.p1[axis] + 0.25f * target.p2[axis];
    }
    if (kind != 1 && random.coin()) ray.tmin = random.any_float();
    if (kind != 1 && random.coin()) ray.tmax = random.any_float();
    const Scene& scene = scenes[random.below(static_cast<std::uint32_t>(scenes.size()))];
    for (const Tracer& tracer : all_tracers()) {
      const Hit closest = tracer.closest(scene, ray);
      for (const Hit& hit : {closest, tracer.any(scene, ray)}) {
        INFO(tracer.name << "\n" << describe(ray) << "\n" << describe(hit));
        if (!is_valid(ray)) REQUIRE_FALSE(hit.found());
        if (!hit.found()) {
          REQUIRE(hit.t == kInfinity);
          continue;
        }
        REQUIRE((hit.t >= effective_tmin(ray) && hit.t <= ray.tmax));
        REQUIRE((hit.geometry < meshes.size() && hit.primitive < meshes[hit.geometry].triangles.size()));
        const float low = -tracer.weight_error, high = 1 + tracer.weight_error;
        REQUIRE((hit.u >= low && hit.v >= low && hit.u <= high && hit.v <= high));
        REQUIRE(hit.error >= 0);
      }
      if (!closest.found()) continue;
      ++hits;
      INFO(tracer.name << "\n" << describe(ray) << "\n" << describe(closest));
      REQUIRE(is_normal_of(closest.normal, corners(meshes[closest.geometry], closest.primitive)));
    }
  }
  CHECK(hits > 1000);
}

TEST_CASE("zero components of either sign are axis-parallel rays", "[ray]") {
  const std::vector<Mesh> meshes{icosphere(3)};
  const std::vector<Scene> scenes = all_scenes(meshes);
  for (unsigned axis = 0; axis < 3; ++axis)
    for (unsigned signs = 0; signs < 8; ++signs) {
      Vec3 d(0), o(0.05f, 0.11f, -0.07f);
      for (unsigned k = 0; k < 3; ++k) {
        const float sign = (signs >> k & 1u) != 0 ? -1.0f : 1.0f;
        d[static_cast<int>(k)] = sign * (k == axis ? 1.0f : 0.0f);
      }
      const Hit hit = one_hit(scenes, make_ray(o, d));
      CHECK(hit.found());
      CHECK(hit.t == Approx(1.0).margin(0.15));
    }
}

TEST_CASE("t is in units of the direction's length, from 1e-18 to 1e18", "[ray]") {
  const std::vector<Mesh> meshes{star(3, 41)};
  const std::vector<Scene> scenes = all_scenes(meshes);
  Random random(42);
  Comparison comparison;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 o = vec3(random.in_cube(1.5)), to = vec3(random.in_cube(0.5));
    const Vec3 d = (to - o) * static_cast<float>(random.log_uniform(1e-18, 1e18));
    const Ray ray = make_ray(o, d);
    compare(meshes, ray, one_hit(scenes, ray), kBounds, comparison);
    INFO(comparison.first_unexplained);
    REQUIRE(comparison.unexplained == 0);
    // A power of two changes nothing but t.
    const Hit hit = one_hit(scenes, make_ray(o, to - o));
    const Hit longer = one_hit(scenes, make_ray(o, (to - o) * 0x1p20f));
    REQUIRE((longer.primitive == hit.primitive && longer.u == hit.u && longer.v == hit.v));
    if (hit.found()) REQUIRE(longer.t == hit.t * 0x1p-20f);
  }
  CHECK(comparison.hits > 500);
}

TEST_CASE("masks hide geometries", "[ray]") {
  std::vector<Mesh> meshes = shelves();
  meshes[0].mask = 1;
  meshes[1].mask = 2;
  meshes[2].mask = 6;
  const std::vector<Scene> scenes = all_scenes(meshes);
  const auto first = [&](std::uint32_t mask) {
    Ray ray = make_ray(Vec3(0.1f, 0.2f, 0), Vec3(0, 0, 1));
    ray.mask = mask;
    return one_hit(scenes, ray).geometry;
  };
  CHECK(first(1) == 0);
  CHECK(first(2) == 1);
  CHECK(first(4) == 2);
  CHECK(first(6) == 1);
  CHECK(first(7) == 0);
  CHECK(first(8) == kInvalidId);
  CHECK(first(0) == kInvalidId);
  CHECK(first(0xffffffffu) == 0);
}

TEST_CASE("a geometry with mask 0 is never seen", "[ray]") {
  std::vector<Mesh> meshes = shelves();
  meshes[0].mask = 0;
  CHECK(one_hit(all_scenes(meshes), make_ray(Vec3(0.1f, 0.2f, 0), Vec3(0, 0, 1))).geometry == 1);
}

TEST_CASE("equal t: the lowest geometry, then the lowest primitive", "[ray]") {
  const Mesh copies = identical(9);
  const std::vector<Scene> scenes = all_scenes({grid_plane(2, 2, -1), copies, copies});
  Random random(51);
  for (int i = 0; i < 200; ++i) {
    const Vec3 o(random.uniform_float(-0.2, 0.2), random.uniform_float(-0.5, 0), random.uniform_float(1, 4));
    const Hit hit =
        one_hit(scenes, make_ray(o, Vec3(random.uniform_float(-0.02, 0.02), random.uniform_float(-0.02, 0.02), -1)));
    REQUIRE(hit.geometry == 1);
    REQUIRE(hit.primitive == 0);
  }
}

TEST_CASE("the normal is cross(p1 - p0, p2 - p0) and u, v belong to corners 1 and 2", "[ray]") {
  const std::vector<Mesh> meshes{soup(500, 0.5, 61)};
  const std::vector<Scene> scenes = all_scenes(meshes);
  Random random(62);
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 o = vec3(random.in_cube(2)), to = vec3(random.in_cube(1));
    for (const Scene& scene : scenes) {
      const Ray ray = make_ray(o, to - o);
      const Hit hit = default_tracer().closest(scene, ray);
      if (!hit.found()) continue;
      ++hits;
      const Corners c = corners(meshes[0], hit.primitive);
      const Vec3 p0 = vec3(c.p0), p1 = vec3(c.p1), p2 = vec3(c.p2), n = glm::cross(p1 - p0, p2 - p0);
      REQUIRE(glm::length(hit.normal - n) <= 1e-5f * (glm::length(p1 - p0) * glm::length(p2 - p0)));
      const Vec3 point = (1 - hit.u - hit.v) * p0 + hit.u * p1 + hit.v * p2;
      const float cosine = std::abs(glm::dot(glm::normalize(n), glm::normalize(ray.direction)));
      REQUIRE(glm::length(point - (o + hit.t * ray.direction)) <= 1e-5f / std::max(cosine, 1e-3f));
    }
  }
  CHECK(hits > 1000);
}
