// The constants of error bounds and of double rays' box tests, each computed from the terms of its proof. A smaller
// constant fails here even where no search for worst cases comes near it.

#include <hiprt_device/query/double_rays.h>
#include <hiprt_device/query/query.h>
#include <hiprt_device/query/t_error.h>
#include <tests/oracle/random.h>
#include <tests/traversal/scenes.h>

#include <tests/catch.h>

#include <cmath>
#include <limits>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr float kUnit = 0x1p-24f;
constexpr double kEndless = std::numeric_limits<double>::infinity();
const Box kCube{{-1, -1, -1}, {1, 1, 1}};

BoxRay<double> box_ray(const Vec3D& origin, const Vec3D& direction, const Box& bounds) {
  return {RayD{.origin = origin, .direction = direction}, bounds, kEndless};
}

/// The hit of a triangle with the corners 0, (4, 0, 0) and (0, 2, 0), moved along z.
template <class P> auto hit_triangle(float z, const BasicRay<typename P::Real>& ray) {
  Mesh mesh;
  mesh.positions = {{0, 0, z}, {4, 0, z}, {0, 2, z}};
  mesh.triangles = {{0, 1, 2}};
  const Scene scene = make_scene({mesh});
  const auto hit = closest_hit<P>(scene.traced, ray);
  REQUIRE(hit.found());
  return hit;
}

/// t_error() of a hit with the normal z and the error 1.
float t_error_of(float condition, const Vec3& direction) {
  SceneView scene;
  scene.condition = condition;
  Hit hit;
  hit.primitive = 0;
  hit.normal = Vec3(0, 0, 2);
  hit.error = 1.0f;
  return t_error(scene, Ray{.origin = {0, 0, 0}, .direction = direction}, hit);
}

}  // namespace

TEST_CASE("a near ray starts where double-rays.md says: 4 h and 2^-44 A before the middle") {
  // From 2^40 away: the bounds' ball 1.74 h; the hit's point 18 u A per axis; the rounding of start 2^-50 A.
  constexpr double kFar = 0x1p40, kBall = 1.74, kPoint = 18 * 0x1p-53, kRounding = 0x1p-50;
  const auto ray = box_ray({-kFar, 0, 0}, {1, 0, 0}, kCube);
  const auto before = double{ray.near_end(kFar)} / (1 - 0x1p-22);
  CHECK(before == Approx(4 + 0x1p-44 * (kFar + 1)).epsilon(0x1p-13));
  CHECK(before >= kBall + (std::sqrt(3.0) * kPoint + kRounding) * (kFar + 1));
  // The extent alone, from close by.
  const auto near = box_ray({-64, 0, 0}, {1, 0, 0}, kCube);
  CHECK(double{near.near_end(64)} / (1 - 0x1p-22) == Approx(4).epsilon(0x1p-20));
}

TEST_CASE("no hit of a triangle that is small beside its distance is earlier than the near ray") {
  // The bounds are 2^-60 large, so that only 2^-44 A remains.
  oracle::Random random(20261129);
  const Box bounds{{-0x1p-60f, -0x1p-60f, -0x1p-60f}, {0x1p-60f, 0x1p-60f, 0x1p-60f}};
  for (unsigned i = 0; i < 20000; ++i) {
    const auto from = random.on_sphere();
    const double length = random.log_uniform(1e-3, 1e3);
    const Vec3D origin(from[0], from[1], from[2]);
    const Vec3D direction = origin * -length;
    INFO("seed 20261129, ray " << i);
    // The ray passes through the middle, at 1 / length.
    REQUIRE(box_ray(origin, direction, bounds).near_end(1 / length) > 0.0f);
  }
}

TEST_CASE("boxes of double rays are widened by at least the sum of double-rays.md") {
  // Step 2: 1.01 U of the near ray's origin. The ray starts in the bounds, so it is near its own origin.
  const auto inside = box_ray({0.5, 0, 0}, {1, 0, 0}, kCube);
  CHECK(inside.margin(0, 0, 0) == 0x1p-23f * 0.5f + 0x1p-45f * (1.5f + 0.5f));
  CHECK(inside.margin(0, 0, 0) >= 1.01f * kUnit * 0.5f);
  CHECK(inside.margin(3, 0, 0) == 3.0f + inside.margin(0, 0, 0));
  // |c - o| + h, from the origin; it contains 18 u A, and 84 M + 25 S of the transforms.
  constexpr float kFar = 0x1p30f, kAway = 0x1p-45f * kFar;
  const Box far{{kFar - 128, -128, -128}, {kFar + 128, 128, 128}};
  const auto away = box_ray({0, 0, 0}, {-1, 0, 0}, far);
  CHECK(away.margin(0, 0, 0) == Approx(kAway).epsilon(0x1p-20));
  CHECK(away.margin(0, 3, 0) == Approx(4 * kAway).epsilon(0x1p-20));
  CHECK(away.margin(0, 3, kFar) == Approx(8 * kAway).epsilon(0x1p-20));
  // M <= A and S <= 2 |o| + A, so that A has the most: 18 + 84 + 25. |o| has 50, R 28.
  CHECK(0x1p-45 >= (18 + 84 + 25) * 0x1p-53);
  // |o|: beside it the near slack is 2^22 times as large.
  const auto at = box_ray({kFar, 0, 0}, {-1, 0, 0}, Box{{kFar, 0, 0}, {kFar, 0, 0}});
  CHECK(at.margin(0, 0, 0) == 0x1p-23f * kFar + kAway);
}

TEST_CASE("the ends of a double ray become floats 2^-22 further out, more than three roundings") {
  auto ray = box_ray({0, 0, 0}, {1, 0, 0}, kCube);
  CHECK(ray.near_end(1.0) == 1.0f - 0x1p-22f);
  ray.set_limit(1.0);
  CHECK(ray.far_end(1.0) == 1.0f + 0x1p-22f);
  CHECK(0x1p-22f > 3 * kUnit);
}

TEST_CASE("Hit::error is 20 (R + E) + 4 S of where-a-hit-is.md") {
  // Claim 1 needs 18 R + S, claim 2 needs 17 R + 22 E + 2 S.
  constexpr float kExtent = 4;
  for (const auto& [z, from] : {std::pair{0.0f, 64.0f}, {1024.0f, 1088.0f}}) {
    CAPTURE(z, from);
    const float reach = 64, magnitude = larger(kExtent, z);
    const float wanted = 20 * (reach + kExtent) + 4 * magnitude;
    const Hit hit = hit_triangle<Policies>(z, Ray{.origin = {0.5f, 0.5f, from}, .direction = {0, 0, -1}});
    CHECK(hit.error == kUnit * wanted);
    CHECK(wanted >= 18 * reach + magnitude);
    CHECK(wanted >= 17 * reach + 22 * kExtent + 2 * magnitude);
    const RayD ray{.origin = {0.5, 0.5, double{from}}, .direction = {0, 0, -1}};
    const float precise = hit_triangle<DoubleRays<>>(z, ray).error;
    CHECK(precise >= 0x1p-53f * wanted);
    CHECK(precise <= 0x1p-53f * wanted * (1 + 0x1p-21f));
  }
}

TEST_CASE("t_error() allows for a normal that is off by 14 C + 8 units of instances.md") {
  // Behind the division: 14 C + 1 of the normal, a division of normal and direction each, three roundings of the sum.
  constexpr float kNeeded = 1 + 2 + 3;
  CHECK(kNeeded <= 8);
  for (const float condition : {0.0f, 1.0f, 5.0f, 100.0f}) {
    CAPTURE(condition);
    // |n|_1 is 1 and |d|_1 is 1 + lean: the cosine's bound is positive from lean > turned (1 + lean) on.
    const float turned = kUnit * (14 * condition + 8);
    CHECK(t_error_of(condition, {1, 0, turned * (1 - 0x1p-12f)}) == std::numeric_limits<float>::infinity());
    CHECK(t_error_of(condition, {1, 0, turned * (1 + 0x1p-10f)}) < std::numeric_limits<float>::infinity());
  }
  // 2^-6: 1 + 4 turned, for the sum of the normal's components, and 1 - turned.
  constexpr float kTurned = 0x1p-6f, kCondition = (kTurned / kUnit - 8) / 14;
  CHECK(t_error_of(kCondition, {0, 0, 1}) == Approx((1 + 4 * kTurned) / (1 - kTurned)).epsilon(1e-6));
  CHECK(4 > std::sqrt(3.0));
}
