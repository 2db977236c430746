// Rays in double that are none, or of any bits.

#include <tests/oracle/meshes.h>
#include <tests/traversal/double_rays.h>
#include <tests/traversal/workers.h>

#include <bit>

using namespace hiprt;
using namespace hiprt::checks;

TEST_CASE("double rays of any bits give sane answers", "[double]") {
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

TEST_CASE("double rays that are no rays miss, and those beyond the range end", "[double]") {
  const std::vector<Mesh> meshes{icosphere(1)};
  const Scene scene = make_scene(meshes);
  constexpr double kInfinity = std::numeric_limits<double>::infinity(), kNan = std::numeric_limits<double>::quiet_NaN();
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
  // No guarantee but to come back, without NaN.
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
