// The box test's promise: a box that a ray touches within [tmin, tmax] by exact arithmetic is never culled.

#include <tests/oracle/random.h>
#include <tests/oracle/ray_box.h>
#include <tests/traversal/box_tests.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/workers.h>

#include <catch2/catch.hpp>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 99;

struct Trial {
  Ray ray;
  Box box;
};

/// A box of random size, place and flatness.
Box random_box(Random& random) {
  const double size = random.log_uniform(1e-6, 1e6), place = random.coin() ? 0.0 : size * random.log_uniform(1, 1e7);
  const bool lattice = random.below(4) == 0;
  Box box{};
  for (std::size_t k = 0; k < 3; ++k) {
    float a = static_cast<float>(random.uniform(-place, place) + random.uniform(-size, size));
    float b = static_cast<float>(a + random.uniform(0, size));
    if (lattice) a = static_cast<float>(random.below(5)) - 2.0f, b = a + static_cast<float>(random.below(3));
    if (random.below(8) == 0) b = a;
    box.min[k] = std::min(a, b);
    box.max[k] = std::max(a, b);
  }
  return box;
}

float nudged(float value, Random& random) {
  const unsigned steps = random.below(3);
  const float toward = random.coin() ? 1e38f : -1e38f;
  for (unsigned i = 0; i < steps; ++i) value = std::nextafter(value, toward);
  return value;
}

/// A point of the box's corners, edges or faces (or inside, rarely).
Position box_point(const Box& box, Random& random) {
  Position p{};
  const unsigned free = random.below(4);
  for (std::size_t k = 0; k < 3; ++k) {
    p[k] = random.coin() ? box.min[k] : box.max[k];
    if (k < free) p[k] = random.uniform_float(box.min[k], box.max[k]);
  }
  return p;
}

/// A ray at the box's corners and edges, from near or far, with tiny and huge directions, zero components, and a range
/// that may end where the box begins.
Ray random_ray(const Box& box, Random& random) {
  const Position to = box_point(box, random);
  double size = 0;
  for (std::size_t k = 0; k < 3; ++k)
    size = std::max({size, double{box.max[k]} - box.min[k], 0.01 * std::abs(double{to[k]})});
  const double distance = (size + 1e-30) * random.log_uniform(1e-3, 1e7);
  const Double3 away = random.on_sphere();
  const bool exact_parameter = random.coin();
  const double factor = exact_parameter ? std::exp2(random.below(40) - 20.0) : random.log_uniform(1e-12, 1e12);
  Ray ray;
  for (std::size_t k = 0; k < 3; ++k) {
    const int i = static_cast<int>(k);
    ray.origin[i] = random.below(6) == 0 ? to[k] : static_cast<float>(to[k] + distance * away[k]);
    ray.direction[i] = nudged(static_cast<float>((to[k] - double{ray.origin[i]}) * factor), random);
    if (random.below(8) == 0) ray.direction[i] = random.coin() ? 0.0f : -0.0f;
  }
  const float t = static_cast<float>(1 / factor);
  if (random.below(3) == 0) ray.tmax = nudged(t, random);
  if (random.below(3) == 0) ray.tmin = std::min(nudged(t, random), ray.tmax);
  return ray;
}

/// Scales a trial by a power of two: exact, so that the geometry stays as tight as it was.
Trial scaled_by(Trial trial, int exponent, int direction_exponent) {
  const auto scale = [](float& value, int by) { value = std::ldexp(value, by); };
  for (std::size_t k = 0; k < 3; ++k) {
    scale(trial.box.min[k], exponent);
    scale(trial.box.max[k], exponent);
    scale(trial.ray.origin[static_cast<int>(k)], exponent);
    scale(trial.ray.direction[static_cast<int>(k)], direction_exponent);
  }
  scale(trial.ray.tmin, exponent - direction_exponent);
  scale(trial.ray.tmax, exponent - direction_exponent);
  return trial;
}

/// The range of ray.h: the largest coordinate in [2^-100, 2^60], the largest direction component in [2^-100, 2^126],
/// their ratio in [2^-100, 2^90].
bool in_documented_range(const Trial& trial) {
  float coordinate = 0, direction = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const int i = static_cast<int>(k);
    coordinate =
        std::max({coordinate, std::abs(trial.box.min[k]), std::abs(trial.box.max[k]), std::abs(trial.ray.origin[i])});
    direction = std::max(direction, std::abs(trial.ray.direction[i]));
  }
  return coordinate <= 0x1p60f && coordinate >= 0x1p-100f && direction >= 0x1p-100f && direction <= 0x1p126f &&
         coordinate <= 0x1p90 * direction && coordinate >= 0x1p-100 * direction;
}

Trial random_trial(Random& random) {
  Trial trial;
  trial.box = random_box(random);
  trial.ray = random_ray(trial.box, random);
  const unsigned kind = random.below(4);
  if (kind == 0) return scaled_by(trial, -static_cast<int>(random.below(110)), -static_cast<int>(random.below(40)));
  if (kind == 1) return scaled_by(trial, static_cast<int>(random.below(25)), static_cast<int>(random.below(25)));
  return trial;
}

/// The scene's bounds: the box itself, or something around it.
Box bounds_around(const Box& box, Random& random) {
  Box bounds = box;
  if (random.coin()) return bounds;
  for (std::size_t k = 0; k < 3; ++k) {
    const float size = (std::abs(box.min[k]) + std::abs(box.max[k])) * random.uniform_float(0, 3);
    bounds.min[k] -= size;
    bounds.max[k] += size;
  }
  return bounds;
}

struct Counts {
  std::uint64_t trials = 0, touched = 0, apart = 0, absent = 0;
  std::vector<std::uint64_t> culled, kept;  ///< Per box test: touched boxes culled, untouched ones kept.
  std::vector<std::string> first;
};

void run_trial(Random& random, Counts& counts) {
  const std::span<const NamedBoxTest> tests = box_tests();
  counts.culled.resize(tests.size());
  counts.kept.resize(tests.size());
  counts.first.resize(tests.size());
  const Trial trial = random_trial(random);
  if (!is_valid(trial.ray) || !in_documented_range(trial)) return;
  const Box bounds = bounds_around(trial.box, random);
  const unsigned child = random.below(4);
  const bool touched = touches(trial.ray, trial.box);
  ++counts.trials;
  ++(touched ? counts.touched : counts.apart);
  for (std::size_t i = 0; i < tests.size(); ++i) {
    const auto [kept, absent] = tests[i].keeps(trial.ray, trial.box, child, bounds);
    counts.absent += absent ? 1 : 0;
    if (!touched) counts.kept[i] += kept ? 1 : 0;
    if (!touched || kept || counts.culled[i]++ != 0) continue;
    char text[200];
    std::snprintf(text, sizeof text, " box (%a,%a,%a)-(%a,%a,%a)", trial.box.min[0], trial.box.min[1], trial.box.min[2],
                  trial.box.max[0], trial.box.max[1], trial.box.max[2]);
    counts.first[i] = describe(trial.ray) + text;
  }
}

}  // namespace

TEST_CASE("absent children are never met, whatever the ray and the box", "[boxes]") {
  INFO("seed " << kSeed + 1);
  Random random(kSeed + 1);
  for (unsigned i = 0; i < trials(200000); ++i) {
    Ray ray;
    Box box{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto finite = [&] {
        const float value = random.any_float();
        return std::isfinite(value) ? value : std::copysign(std::numeric_limits<float>::max(), value);
      };
      const int axis = static_cast<int>(k);
      ray.origin[axis] = random.below(8) == 0 ? 0.0f : finite();
      ray.direction[axis] = random.below(8) == 0 ? 0.0f : finite();
      const float a = finite(), b = finite();
      box.min[k] = std::min(a, b);
      box.max[k] = std::max(a, b);
    }
    if (!is_valid(ray)) continue;
    for (const NamedBoxTest& test : box_tests()) {
      INFO(test.name << ": " << describe(ray));
      REQUIRE_FALSE(test.keeps(ray, box, i % 4, box).absent);
    }
  }
}

TEST_CASE("a touched box is never culled by the conservative test", "[boxes]") {
  INFO("seed " << kSeed);
  constexpr unsigned kBlock = 5000;
  const auto results = for_each_parallel<Counts>(trials(3000000) / kBlock + 1, [](std::size_t block, Counts& counts) {
    Random random(kSeed + block);
    for (unsigned i = 0; i < kBlock; ++i) run_trial(random, counts);
  });
  Counts sum;
  const std::size_t tests = box_tests().size();
  sum.culled.resize(tests), sum.kept.resize(tests), sum.first.resize(tests);
  for (const Counts& part : results) {
    sum.trials += part.trials, sum.touched += part.touched, sum.apart += part.apart, sum.absent += part.absent;
    for (std::size_t i = 0; i < part.culled.size(); ++i) {
      sum.culled[i] += part.culled[i], sum.kept[i] += part.kept[i];
      if (sum.first[i].empty()) sum.first[i] = part.first[i];
    }
  }
  std::printf("boxes: %lu trials at corners and edges, %lu touched\n", sum.trials, sum.touched);
  for (std::size_t i = 0; i < tests; ++i) {
    const NamedBoxTest& test = box_tests()[i];
    std::printf("  %-24s wrongly culled %lu, kept though untouched %lu\n", test.name, sum.culled[i], sum.kept[i]);
    INFO(test.name << ": " << sum.first[i]);
    if (test.conservative) CHECK(sum.culled[i] == 0);
    CHECK(sum.kept[i] < sum.apart);  // It does cull.
  }
  CHECK(sum.absent == 0);
  CHECK(sum.touched > sum.trials / 10);
  CHECK(sum.apart > sum.trials / 10);
}
