// The box test never culls a box that the ray touches within [tmin, tmax] by exact arithmetic. In rounded layouts this
// holds for the original box and for the stored one.

#include <hiprt_device/format/layout.h>
#include <tests/oracle/random.h>
#include <tests/oracle/ray_box.h>
#include <tests/traversal/boxes/box_tests.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/workers.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 99;

struct Trial {
  Ray ray;
  NodeBoxes boxes;
  unsigned child;  ///< The one that the ray is aimed at.
};

/// A box of random size, position and flatness.
Box random_box(Random& random) {
  const double size = random.log_uniform(1e-6, 1e6), offset = random.coin() ? 0.0 : size * random.log_uniform(1, 1e7);
  const bool lattice = random.below(4) == 0;
  Box box{};
  for (std::size_t k = 0; k < 3; ++k) {
    float a = static_cast<float>(random.uniform(-offset, offset) + random.uniform(-size, size));
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

/// A ray at the box's corners and edges, from near or far. Directions are tiny or huge and may have zero components.
/// The range may end where the box begins.
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

/// The child's siblings: none, or boxes near it of any size, which make the grid of a quantized node coarse.
NodeBoxes with_siblings(const Box& box, unsigned child, Random& random) {
  NodeBoxes boxes;
  boxes.child[child] = box;
  if (random.below(3) == 0) return boxes;
  double size = 0;
  for (std::size_t k = 0; k < 3; ++k) size = std::max(size, double{box.max[k]} - box.min[k]);
  size = (size + 1e-30) * random.log_uniform(1e-2, 1e4);
  for (unsigned i = 0; i < kBranching; ++i) {
    if (i == child || random.below(3) == 0) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const float a = static_cast<float>(box.min[k] + random.uniform(-size, size));
      boxes.child[i].min[k] = a;
      boxes.child[i].max[k] = std::max(a, static_cast<float>(a + random.uniform(0, size)));
    }
  }
  return boxes;
}

void scale_by(float& value, int exponent) { value = std::ldexp(value, exponent); }

/// Scales by a power of two. That is exact, so tight boxes stay tight. Empty boxes do not change.
void scale_boxes(NodeBoxes& boxes, int exponent) {
  for (Box& box : boxes.child)
    for (std::size_t k = 0; k < 3; ++k) scale_by(box.min[k], exponent), scale_by(box.max[k], exponent);
}
void scale_ray(Ray& ray, int exponent, int direction_exponent) {
  for (int k = 0; k < 3; ++k) scale_by(ray.origin[k], exponent), scale_by(ray.direction[k], direction_exponent);
  scale_by(ray.tmin, exponent - direction_exponent);
  scale_by(ray.tmax, exponent - direction_exponent);
}

/// The range of ray.h: the largest coordinate in [2^-100, 2^60], the largest direction component in [2^-100, 2^126],
/// their ratio in [2^-100, 2^90].
bool in_documented_range(const Ray& ray, const Box& bounds) {
  float coordinate = 0, direction = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const int i = static_cast<int>(k);
    coordinate = std::max({coordinate, std::abs(bounds.min[k]), std::abs(bounds.max[k]), std::abs(ray.origin[i])});
    direction = std::max(direction, std::abs(ray.direction[i]));
  }
  return coordinate <= 0x1p60f && coordinate >= 0x1p-100f && direction >= 0x1p-100f && direction <= 0x1p126f &&
         coordinate <= 0x1p90 * direction && coordinate >= 0x1p-100 * direction;
}

void grow(Box& box, const Box& by) {
  for (std::size_t k = 0; k < 3; ++k) {
    box.min[k] = std::min(box.min[k], by.min[k]);
    box.max[k] = std::max(box.max[k], by.max[k]);
  }
}

/// The scene's bounds: the boxes' own, or something around them.
Box bounds_around(const NodeBoxes& boxes, Random& random) {
  Box bounds = NodeBoxes::kEmpty;
  for (const Box& box : boxes.child) grow(bounds, box);
  if (random.coin()) return bounds;
  for (std::size_t k = 0; k < 3; ++k) {
    const float size = (std::abs(bounds.min[k]) + std::abs(bounds.max[k])) * random.uniform_float(0, 3);
    bounds.min[k] -= size;
    bounds.max[k] += size;
  }
  return bounds;
}

bool holds(const Box& box, const Box& inner) {
  for (std::size_t k = 0; k < 3; ++k)
    if (!(box.min[k] <= inner.min[k] && inner.max[k] <= box.max[k])) return false;
  return true;
}

/// The results of one box test.
struct Count {
  std::uint64_t touched = 0, apart = 0;  ///< By exact arithmetic,
  std::uint64_t culled = 0, kept = 0;    ///< and of those wrongly culled, and kept.
  std::uint64_t smaller = 0;             ///< The node's box does not hold the one that was put in.
  std::uint64_t absent = 0;              ///< An absent child passes: an invalid reference would be followed.
  std::uint64_t unable = 0;              ///< No node can hold the boxes.
  std::string first;

  void add(const Count& part) {
    touched += part.touched, apart += part.apart, culled += part.culled, kept += part.kept;
    smaller += part.smaller, absent += part.absent, unable += part.unable;
    if (first.empty()) first = part.first;
  }
};

/// @param within true: the scene's bounds contain the node's rounded box, and rays that touch that box must pass.
///   false: the bounds contain the boxes before rounding, and rays that touch the given box must pass.
void run_test(const NamedBoxTest& test, const Trial& trial, const Box& bounds, bool within, Count& count) {
  NodeBoxes seen = trial.boxes;
  if (!test.round(seen)) {
    ++count.unable;
    return;
  }
  Box box = trial.boxes.child[trial.child], around = bounds;
  const Box& child = seen.child[trial.child];
  if (!holds(child, box)) ++count.smaller;
  if (within) {
    box = bounded(child, bounds);
    grow(around, box);
  }
  if (!in_documented_range(trial.ray, around)) return;
  const std::uint32_t passing = test.passing(trial.ray, trial.boxes, around);
  for (unsigned i = 0; i < kBranching; ++i)
    if ((passing >> i & 1u) != 0 && trial.boxes.child[i].min[0] > trial.boxes.child[i].max[0]) ++count.absent;
  const bool touched = touches(trial.ray, box), kept = (passing >> trial.child & 1u) != 0;
  ++(touched ? count.touched : count.apart);
  if (!touched) count.kept += kept ? 1 : 0;
  if (!touched || kept || count.culled++ != 0) return;
  char text[200];
  std::snprintf(text, sizeof text, " box (%a,%a,%a)-(%a,%a,%a)", box.min[0], box.min[1], box.min[2], box.max[0],
                box.max[1], box.max[2]);
  count.first = describe(trial.ray) + text;
}

void run_trial(Random& random, std::vector<Count>& counts) {
  const std::span<const NamedBoxTest> tests = box_tests();
  counts.resize(tests.size());
  Trial trial;
  trial.child = random.below(4);
  trial.boxes = with_siblings(random_box(random), trial.child, random);
  const unsigned kind = random.below(4);
  int exponent = 0, direction_exponent = 0;
  if (kind == 0)
    exponent = -static_cast<int>(random.below(110)), direction_exponent = -static_cast<int>(random.below(40));
  if (kind == 1) exponent = static_cast<int>(random.below(25)), direction_exponent = static_cast<int>(random.below(25));
  // At the box, or at the box as one of the layouts rounds it.
  Box target = trial.boxes.child[trial.child];
  scale_boxes(trial.boxes, exponent);
  if (random.coin()) {
    NodeBoxes seen = trial.boxes;
    if (tests[random.below(static_cast<std::uint32_t>(tests.size()))].round(seen)) {
      scale_boxes(seen, -exponent);
      target = bounded(seen.child[trial.child], target);
    }
  }
  trial.ray = random_ray(target, random);
  scale_ray(trial.ray, exponent, direction_exponent);
  if (!is_valid(trial.ray)) return;
  const Box bounds = bounds_around(trial.boxes, random);
  const bool within = random.coin();
  for (std::size_t i = 0; i < tests.size(); ++i) run_test(tests[i], trial, bounds, within, counts[i]);
}

}  // namespace

TEST_CASE("absent children are never hit, for any ray and box", "[boxes]") {
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
    NodeBoxes boxes;
    boxes.child[i % 4] = box;
    for (const NamedBoxTest& test : box_tests()) {
      INFO(test.name << ": " << describe(ray));
      NodeBoxes rounded = boxes;
      if (test.round(rounded)) REQUIRE((test.passing(ray, boxes, box) & ~(1u << i % 4)) == 0);
    }
  }
}

TEST_CASE("a touched box is never culled by the conservative test", "[boxes]") {
  INFO("seed " << kSeed);
  constexpr unsigned kBlock = 5000;
  using Counts = std::vector<Count>;
  const auto results = for_each_parallel<Counts>(trials(2000000) / kBlock + 1, [](std::size_t block, Counts& counts) {
    Random random(kSeed + block);
    for (unsigned i = 0; i < kBlock; ++i) run_trial(random, counts);
  });
  Counts sum(box_tests().size());
  for (const Counts& part : results)
    for (std::size_t i = 0; i < part.size(); ++i) sum[i].add(part[i]);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const NamedBoxTest& test = box_tests()[i];
    const Count& count = sum[i];
    const std::uint64_t trials = count.touched + count.apart;
    std::printf(
        "boxes: %-28s %lu trials at corners and edges, %lu touched, wrongly culled %lu, kept though untouched %lu\n",
        test.name, trials, count.touched, count.culled, count.kept);
    INFO(test.name << ": " << count.first);
    if (test.conservative) CHECK(count.culled == 0);
    CHECK(count.kept < count.apart);  // It does cull.
    CHECK(count.smaller == 0);
    CHECK(count.absent == 0);
    CHECK(count.unable == 0);
    CHECK(count.touched > trials / 10);
    CHECK(count.apart > trials / 10);
  }
}
