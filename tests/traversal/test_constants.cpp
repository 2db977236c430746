// The constants of the proofs, each computed from the terms of its proof. A smaller constant fails here even where no
// search for worst cases comes near it.

#include <hiprt_build/format/moving_box.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/instances/instance_surface.h>
#include <hiprt_device/intersect/exact_triangle_test.h>

#include <tests/catch.h>

#include <cmath>
#include <limits>

using namespace hiprt;

namespace {

constexpr float kUnit = 0x1p-24f;

/// The margin of a ray from the origin's corner of bounds, divided by 2^-24.
float margin(const Vec3& origin, const Box& bounds, float condition, float reach) {
  return Conservative::margin(origin, bounds, condition, reach) / kUnit;
}

}  // namespace

TEST_CASE("every plane of the bounds counts for how far a scene reaches") {
  for (const unsigned axis : {0u, 1u, 2u})
    for (const bool high : {false, true}) {
      CAPTURE(axis, high);
      Box bounds{{-1, -1, -1}, {1, 1, 1}};
      (high ? bounds.max : bounds.min)[axis] = high ? 8.0f : -8.0f;
      Vec3 origin{0, 0, 0};
      origin[static_cast<int>(axis)] = high ? -2.0f : 2.0f;
      const Extents extents(origin, bounds);
      CHECK(extents.reach == 10.0f);
      CHECK(extents.magnitude == 8.0f);
    }
}

TEST_CASE("the margin of boxes is at least the sum of conservative-boxes.md") {
  // Steps 1 to 4, and the worst column of steps 5 and 6.
  const double corners = 5.0, depth = 12.0, sideways = depth + corners + 1.0, small = 0.25, slabs = 5.0;
  const Box unit{{0, 0, 0}, {1, 1, 1}};
  // From the origin: M = 1 and S = 1, so their sum; far away M and S differ.
  const float near = margin({0, 0, 0}, unit, 0, 0), far = margin({-1024, 0, 0}, unit, 0, 0);
  CHECK(near == 24.0f + 4.0f);
  CHECK(far == 24.0f * 1025 + 4.0f * 1025);
  const float reach = margin({0.5f, 0.5f, 0.5f}, unit, 0, 0);
  CHECK(reach == 24.0f * 0.5f + 4.0f * 1.5f);
  const float factor_m = 1.5f * near - reach;
  CHECK(factor_m >= static_cast<float>(sideways + small + slabs));
}

TEST_CASE("the margin of instances is at least the sum of instances.md") {
  const double root3 = std::sqrt(3.0);
  // Triangles: sqrt(3) (24 M' + 4 S'), with S' = S2 + 2 R; the transform: 5.2 M2 + 6.2 (S2 + R). M2 and S2 are at most
  // the root of 3 times M and S.
  const double needed_m = (24 * root3 + 5.2) * root3, needed_s = (4 * root3 + 6.2) * root3;
  const double needed_reach = 2 * 4 * root3 + 6.2;
  const Box unit{{0, 0, 0}, {1, 1, 1}};
  const Vec3 origin{0.5f, 0.5f, 0.5f};
  const float own = margin(origin, unit, 0, 0), with = margin(origin, unit, 1, 0), reach = margin(origin, unit, 1, 1);
  CHECK(reach - with == 28.0f);
  CHECK(with - own == 84.0f * 0.5f + 25.0f * 1.5f);
  CHECK(reach - with >= needed_reach);
  CHECK(with - own >= needed_m * 0.5 + needed_s * 1.5);
  const float twice = margin(origin, unit, 2, 1);
  CHECK(twice - own == 2 * (reach - own));
}

TEST_CASE("directions are raised to 2^-26 of the largest component, a quarter of a unit") {
  // Step 4: the ray moves by 2^-26 M, which is u M / 4.
  const RaySlabs<ArrayLanes> slabs(Ray{.origin = {1, 1, 1}, .direction = {0, 3, 0x1p-40f}}, 0.0f);
  CHECK(std::fabs(ArrayLanes::value(slabs.rcp[0])) == 1.0f / (3 * kUnit / 4));
  CHECK(std::fabs(ArrayLanes::value(slabs.rcp[2])) == 1.0f / (3 * kUnit / 4));
}

TEST_CASE("the rounding of a moving box is the sum of moving_box.h, and builders add a quarter") {
  // Fraction 2 u, times a term of at most 2 m: 4; difference and product 2 each; sum 1. Rounded up, and box_at() twice.
  constexpr double kNeeded = 4 + 2 + 2 + 1;
  const Box box{{-3, -3, -3}, {1, 1, 1}};
  format_detail::BoxDrift drift;
  drift.max[1] = 7;
  CHECK(format_detail::moving_box_slack(box, drift, 0) >= kNeeded * double{kUnit} * 3);
  CHECK(format_detail::moving_box_slack(box, drift, 0) == 12 * double{kUnit} * 3);
  CHECK(format_detail::moving_box_slack(box, drift, 1) == 12 * double{kUnit} * 8);
  const auto [begin, end] = format_detail::moving_box(box, drift, box);
  CHECK(double{begin.max[1]} >= 1 + 1.25 * 12 * double{kUnit} * 8);
  CHECK(double{begin.max[1]} <= 1 + 1.25 * 12 * double{kUnit} * 8 + 0x1p-22);
  CHECK(double{begin.min[0]} <= -3 - 1.25 * 12 * double{kUnit} * 3);
}

TEST_CASE("the filter of exact decisions is at least the sum of exact-decisions.md") {
  struct Sheared {
    ArrayLanes::Float x, y, z;
  };
  // Shears of a quarter and a half: s = 1 / 2.
  const Reference::PreparedRay<ArrayLanes> ray(Ray{.origin = {0, 0, 0}, .direction = {1, 2, 4}});
  const auto filter = [&](float x, float y, float z) {
    using Lanes = ArrayLanes;
    const Sheared at{Lanes::set(x, 0, 0, 0), Lanes::set(0, y, 0, 0), Lanes::set(0, 0, 0, z)};
    return double{Reference::uncertainty<Lanes>(at, ray)};
  };
  // Two units of each factor of a product, and Kahan's two, for T^2; three of each depth, for T s |z|.
  const double own = 2 + 2 + 2, of_depth = 3 + 3, unit = kUnit;
  const double wide = 3, deep = 8;  // T, and s |z|; R is the larger.
  CHECK(filter(3, 0, 0) >= unit * own * wide * wide);
  CHECK(filter(0, 0, 16) >= 2 * (3 * unit * deep) * (3 * unit * deep));
  // The value of the page: 7 u R (T + 4 u R) + 2^-98.
  CHECK(filter(3, 2, 0) == Approx(7 * unit * 3 * (3 + 4 * unit * 3)).epsilon(0x1p-22));
  CHECK(filter(0, 0, 16) == Approx(7 * unit * deep * 4 * unit * deep).epsilon(0x1p-22));
  CHECK(filter(2, 3, 16) == Approx(7 * unit * deep * (3 + 4 * unit * deep)).epsilon(0x1p-22));
  CHECK(filter(2, 3, 16) >= unit * of_depth * deep * 3);
  CHECK(filter(0, 0, 0) == 0x1p-98);
}

TEST_CASE("errors of instances: ten roundings inside, fourteen and six of a motion") {
  surface_detail::EnteredInstance<true, float> still, moving;
  InstanceRecord record{};
  for (unsigned k = 0; k < 3; ++k) record.linear[k][k] = 1.0f;
  const Ray ray{.origin = {8, 0, 0}, .direction = {0, 0, 0}};
  still.enter(record, nullptr, ray, 1.0f);
  // inside_ alone: ten roundings of a length of 8, rounded up.
  CHECK(still.error_outside(0.0f) >= 10 * kUnit * 8);
  CHECK(still.error_outside(0.0f) <= 10 * kUnit * 8 * (1 + 0x1p-20f));
  MotionRecord motion{};
  motion.rounding = 2.0f;
  motion.farthest = 5.0f;
  moving.enter(record, &motion, ray, 1.0f);
  const float added = moving.error_outside(0.0f) - still.error_outside(0.0f);
  CHECK(added >= kUnit * (14 * 2 * 8 + 6 * 5) * (1 - 0x1p-18f));
  CHECK(added <= kUnit * (14 * 2 * 8 + 6 * 5) * (1 + 0x1p-18f));
}

TEST_CASE("a float holds the normal of any triangle, whichever axis it is along") {
  // Cross products of 2^-298 and 2^250, and one that needs no scale.
  for (const double size : {0x1p-149, 1.0, 0x1p125})
    for (const unsigned axis : {0u, 1u, 2u}) {
      CAPTURE(size, axis);
      double edge1[3] = {0, 0, 0}, edge2[3] = {0, 0, 0};
      edge1[(axis + 1) % 3] = edge2[(axis + 2) % 3] = size;
      const Vec3 normal = surface_detail::make_normal<float>(edge1, edge2);
      for (const unsigned k : {0u, 1u, 2u}) {
        const float x = normal[static_cast<int>(k)];
        CHECK((k == axis ? x > 0.0f && x <= std::numeric_limits<float>::max() : x == 0.0f));
      }
    }
}
