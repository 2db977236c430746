// The parts of a cut triangle, by rational arithmetic: they hold every corner of the exact parts, and no more than that
// and one float. The capacity for cuts.

#include <hiprt_build/sah_sbvh/spatial_bins.h>
#include <tests/oracle/exact.h>
#include <tests/oracle/random.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::build;
using namespace hiprt::oracle;

namespace {

constexpr std::uint64_t kSeed = 20261127;

struct ExactBox {
  Rational min[3], max[3];
  bool empty = true;

  void add(const Rational (&p)[3]) {
    for (unsigned k = 0; k < 3; ++k) {
      if (empty || p[k] < min[k]) min[k] = p[k];
      if (empty || p[k] > max[k]) max[k] = p[k];
    }
    empty = false;
  }
};

/// Adds the corners of the part of a triangle on one side of the plane.
void add_part(const Point (&v)[3], unsigned axis, float plane, bool left, ExactBox& box) {
  for (unsigned i = 0; i < 3; ++i) {
    const Point &a = v[i], &b = v[(i + 1) % 3];
    Rational p[3];
    for (unsigned k = 0; k < 3; ++k) p[k] = exact(a.x[k]);
    if (left ? a.x[axis] <= plane : a.x[axis] >= plane) box.add(p);
    if (!((a.x[axis] < plane && b.x[axis] > plane) || (a.x[axis] > plane && b.x[axis] < plane))) continue;
    const Rational part = (exact(plane) - exact(a.x[axis])) / (exact(b.x[axis]) - exact(a.x[axis]));
    for (unsigned k = 0; k < 3; ++k) p[k] += part * (exact(b.x[k]) - exact(a.x[k]));
    box.add(p);
  }
}

void check_part(const SimdBox& box, const ExactBox& part) {
  for (unsigned k = 0; k < 3; ++k) {
    const float low = box.min[static_cast<int>(k)], high = box.max[static_cast<int>(k)];
    REQUIRE(exact(low) <= part.min[k]);
    REQUIRE(exact(high) >= part.max[k]);
    const float inner_low = std::nextafter(std::nextafter(low, 1e38f), 1e38f);
    const float inner_high = std::nextafter(std::nextafter(high, -1e38f), -1e38f);
    REQUIRE(exact(inner_low) >= part.min[k]);
    REQUIRE(exact(inner_high) <= part.max[k]);
  }
}

}  // namespace

TEST_CASE("parts of a cut triangle contain the exact parts and are tight", "[clip]") {
  Random random(kSeed);
  unsigned cuts = 0;
  for (unsigned i = 0; i < 4000; ++i) {
    LeafCorners corners{};
    // Far from the origin, slender, or neither.
    const double far = i % 3 == 0 ? 1e4 : 0.0, size = random.log_uniform(1e-3, 10);
    for (Point& p : corners.v)
      for (float& x : p.x) x = static_cast<float>(far) + random.uniform_float(-size, size);
    const bool pair = random.coin();
    SimdBox whole;
    for (unsigned k = 0; k < (pair ? 4u : 3u); ++k) whole.add(to_float4(corners.v[k]));
    const unsigned axis = random.below(3);
    const float low = whole.min[static_cast<int>(axis)], high = whole.max[static_cast<int>(axis)];
    const float plane = random.uniform_float(low, high);
    if (!(plane > low && plane < high)) continue;
    const SplitBounds parts = split_bounds(corners, pair, whole, axis, plane);
    ExactBox exact_left, exact_right;
    const Point(&v)[4] = corners.v;
    for (const bool left : {true, false}) {
      ExactBox& box = left ? exact_left : exact_right;
      add_part({v[0], v[1], v[2]}, axis, plane, left, box);
      if (pair) add_part({v[1], v[3], v[2]}, axis, plane, left, box);
    }
    INFO("seed " << kSeed << ", triangle " << i);
    if (exact_left.empty || exact_right.empty) continue;
    ++cuts;
    check_part(parts.left, exact_left);
    check_part(parts.right, exact_right);
  }
  CHECK(cuts > 3000);
}

TEST_CASE("halves share the capacity for cuts by the number and the length of their references") {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  CHECK(left_capacity(100, {30, 2}, {10, 2}) == 75);
  CHECK(left_capacity(100, {10, 9}, {30, 1}) == 50);
  CHECK(left_capacity(100, {10, 0}, {10, 1}) == 0);
  CHECK(left_capacity(100, {10, 1}, {10, 0}) == 100);
  // By the number, where areas say nothing.
  CHECK(left_capacity(100, {30, 0}, {10, 0}) == 75);
  CHECK(left_capacity(100, {30, kInfinity}, {10, kInfinity}) == 75);
  CHECK(left_capacity(100, {30, kInfinity}, {10, 1}) == 75);
  CHECK(left_capacity(100, {30, 1}, {10, kInfinity}) == 75);
  CHECK(left_capacity(0, {30, 1}, {10, 1}) == 0);
  CHECK(left_capacity(1u << 29, {1u << 29, 1e38f}, {1, 1e-38f}) <= 1u << 29);
}
