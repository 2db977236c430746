// Rays in double: invalid rays, and rays with arbitrary bits.

#include <tests/oracle/meshes.h>
#include <tests/traversal/double_rays.h>
#include <tests/traversal/instances/instance_scenes.h>
#include <tests/traversal/workers.h>

#include <bit>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity(), kNan = std::numeric_limits<double>::quiet_NaN();

template <class LayoutType> struct FarPlaced : Instanced<DoubleRays<WithLayout<LayoutType>>, 1> {};

/// Squares in the planes z = 1, 2, 4 with corners at +-1: double rays of whole numbers meet them at exact distances.
std::vector<Mesh> shelves() { return {grid_plane(3, 2, 1), grid_plane(3, 2, 2), grid_plane(3, 2, 4)}; }

/// What ray.h says of a ray from the origin along z through the shelves: the first distance in [tmin, tmax].
double expected_t(double tmin, double tmax) {
  if (!std::isfinite(tmin) || std::isnan(tmax) || tmin > tmax) return kInfinity;
  for (const double t : {1.0, 2.0, 4.0})
    if (t >= tmin && t <= tmax) return t;
  return kInfinity;
}

}  // namespace

TEST_CASE("double rays of any bits give valid results", "[double]") {
  const std::vector<Mesh> meshes{icosphere(2)};
  const Scene scene = make_scene(meshes);
  Random random(kDoubleSeed);
  const auto any = [&](double usual) {
    return random.below(3) == 0 ? std::bit_cast<double>(random.bits()) : random.uniform(-usual, usual);
  };
  unsigned hits = 0;
  for (unsigned i = 0; i < trials(60000); ++i) {
    RayD ray;
    for (int k = 0; k < 3; ++k) {
      ray.origin[k] = i % 2 == 0 ? any(3) : random.uniform(-3, 3);
      ray.direction[k] = i % 2 == 0 ? any(3) : random.uniform(-1, 1) - ray.origin[k];
    }
    if (i % 4 == 0) ray.tmin = any(1);
    if (i % 8 == 0) ray.tmax = any(2);
    INFO("ray " << i << " of seed " << kDoubleSeed << ": " << describe(ray));
    const HitD hit = closest(scene.traced, ray);
    REQUIRE_FALSE(hit.failed());
    if (!hit.found()) continue;
    ++hits;
    REQUIRE(std::isfinite(hit.t));
    REQUIRE(hit.t >= std::max(ray.tmin, 0.0));
    REQUIRE(hit.t <= ray.tmax);
    REQUIRE(std::isfinite(hit.u));
    REQUIRE(std::isfinite(hit.v));
    REQUIRE_FALSE(std::isnan(hit.error));
  }
  CHECK(hits > trials(60000) / 20);
}

TEST_CASE("invalid double rays miss, and rays beyond the range terminate", "[double]") {
  const std::vector<Mesh> meshes{icosphere(1)};
  const Scene scene = make_scene(meshes);
  RayD good;
  good.origin = {0.1, 0.2, -5};
  REQUIRE(closest(scene.traced, good).found());
  for (const double bad : {kInfinity, -kInfinity, kNan})
    for (int k = 0; k < 3; ++k) {
      RayD ray = good;
      ray.origin[k] = bad;
      CHECK_FALSE(closest(scene.traced, ray).found());
      ray = good;
      ray.direction[k] = bad;
      CHECK_FALSE(closest(scene.traced, ray).found());
    }
  RayD ray = good;
  ray.direction = {0, -0.0, 0};
  CHECK_FALSE(closest(scene.traced, ray).found());
  ray = good;
  ray.tmin = 7, ray.tmax = 6.5;
  CHECK_FALSE(closest(scene.traced, ray).found());
  ray = good;
  ray.tmin = kNan;
  CHECK_FALSE(closest(scene.traced, ray).found());
  // Lengths of directions in the range, and origins up to its end.
  for (const double length : {0x1p-200, 1e-30, 1e30, 0x1p199}) {
    ray = good;
    ray.direction *= length;
    CHECK(closest(scene.traced, ray).found());
  }
  for (const double far : {1e6, 1e15, 1e30}) {
    ray = {};
    ray.origin = {0, 0, -far};
    const HitD hit = closest(scene.traced, ray);
    CHECK(hit.found());
    CHECK(std::abs(hit.t - far) <= 1 + far * 4 * kDoubleUnit);
  }
  // The only guarantee: the query returns, without NaN.
  for (const double extreme : {1e-320, 1e-300, 1e200, 1e300, 1.7e308}) {
    ray = good;
    ray.origin.z = -extreme;
    HitD hit = closest(scene.traced, ray);
    CHECK_FALSE(hit.failed());
    ray = good;
    ray.direction *= extreme;
    hit = closest(scene.traced, ray);
    CHECK_FALSE(hit.failed());
  }
}

TEST_CASE("tmin and tmax of double rays: every pair of ends, NaN, and infinity", "[double]") {
  std::vector<double> ends{kNan, -kNan, kInfinity, -kInfinity, -1e300, -1, -0.0, 0, 0x1p-1074, 3, 1e300};
  for (const double t : {1.0, 2.0, 4.0})
    for (const double end : {std::nextafter(t, 0.0), t, std::nextafter(t, 9.0)}) ends.push_back(end);
  ends.push_back(std::numeric_limits<double>::max());
  const std::vector<Mesh> meshes = shelves();
  for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized}) {
    const Scene scene = make_scene(meshes, {.nodes = layout});
    // Behind an instance that stands where it is.
    InstanceScene placed;
    placed.add_file(meshes, layout);
    placed.groups.push_back({{.object = 0}});
    placed.build();
    unsigned hits = 0;
    for (const double tmin : ends)
      for (const double tmax : ends) {
        RayD ray;
        ray.origin = {0.1, 0.2, 0};
        ray.tmin = tmin, ray.tmax = tmax;
        INFO("layout " << static_cast<unsigned>(layout) << ", tmin " << tmin << ", tmax " << tmax);
        const double expected = expected_t(tmin, tmax);
        hits += expected < kInfinity ? 1 : 0;
        const auto check = [&](const HitD& hit, bool any_found) {
          CHECK(hit.found() == (expected < kInfinity));
          CHECK(hit.t == expected);
          CHECK(any_found == hit.found());
        };
        check(closest(scene.traced, ray), any(scene.traced, ray));
        with_layout<FarPlaced>(placed.view(), [&](auto p) {
          using P = decltype(p);
          check(closest_hit<P>(placed.view(), ray), any_hit<P>(placed.view(), ray).found());
        });
      }
    CHECK(hits > 50);
  }
}

TEST_CASE("a double hit's own t works as tmin, as tmax, and as both", "[double]") {
  INFO("seed " << kDoubleSeed);
  const std::vector<Mesh> meshes{star(3, 21)};
  const Scene scene = make_scene(meshes);
  Random random(kDoubleSeed);
  for (unsigned i = 0; i < trials(3000); ++i) {
    const RayD ray = ray_at_triangle(meshes[0], random, {0, 0, 0}, i % 3 == 0 ? 1e7 : 1.5);
    INFO("ray " << i << ": " << describe(ray));
    const HitD hit = closest(scene.traced, ray);
    REQUIRE(hit.found());
    const auto part = [&](double tmin, double tmax) {
      RayD result = ray;
      result.tmin = tmin, result.tmax = tmax;
      return closest(scene.traced, result);
    };
    check_same(part(0, hit.t), hit);
    check_same(part(hit.t, kInfinity), hit);
    check_same(part(hit.t, hit.t), hit);
    const double before = std::nextafter(hit.t, -1.0), behind = std::nextafter(hit.t, kInfinity);
    REQUIRE_FALSE(part(before, before).found());
    REQUIRE_FALSE(part(0, before).found());
    REQUIRE(part(behind, kInfinity).t > hit.t);
    // The hit lies between the ends, but in the wrong order.
    REQUIRE_FALSE(part(behind, before).found());
    REQUIRE_FALSE(part(kNan, hit.t).found());
    REQUIRE_FALSE(part(0, kNan).found());
    REQUIRE_FALSE(part(0, -kInfinity).found());
    REQUIRE_FALSE(part(kInfinity, kInfinity).found());
  }
}
