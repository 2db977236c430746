// Boxes of moving objects, for all times and moving: no point is outside at random times, and a search finds none.

#include <tests/traversal/instances/recorded_motion.h>

#include <hiprt_device/instances/moving_box.h>
#include <tests/oracle/hill_climb.h>
#include <tests/traversal/workers.h>

#include <cmath>
#include <cstdio>
#include <limits>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261122;

/// Where a tracer has a box at a time.
Box traced_box(const std::array<Box, 2>& box, const format_detail::Shutter& shutter, float time) {
  SceneView scene;
  scene.shutter_begin = shutter.begin;
  scene.shutter_rate = shutter.rate;
  const Box both[2] = {box[0], box[1]};
  return box_at(both, shutter_fraction(scene, time));
}

double half_area(const Box& box) {
  const double x = double{box.max[0]} - box.min[0], y = double{box.max[1]} - box.min[1],
               z = double{box.max[2]} - box.min[2];
  return x * y + y * z + z * x;
}

}  // namespace

TEST_CASE("moving boxes contain their content at every time, exactly") {
  Random random(kSeed + 2);
  for (const MotionKind kind : kKinds) {
    double sum = 0.0, smallest = 1.0;
    unsigned count = 0;
    for (unsigned i = 0; i < trials(3000); ++i) {
      const double spread = i % 4 == 0 ? 1e5 : i % 4 == 1 ? 0.0 : 4.0;
      const build::Motion motion = random_motion(random, kind, 2 + random.below(3), spread);
      const Recorded recorded(motion);
      // As long as its keys, or longer.
      const float first = motion.keys.front().time - (random.coin() ? 0.0f : random.uniform_float(0, 3)),
                  last = motion.keys.back().time + (random.coin() ? 0.0f : random.uniform_float(0, 3));
      const format_detail::Shutter shutter{first, affine_detail::round_down(1.0 / (double{last} - double{first}))};
      const auto corner = random.in_cube(i % 3 == 0 ? 100 : 1), other = random.in_cube(1);
      Box box;
      for (unsigned axis = 0; axis < 3; ++axis) {
        box.min[axis] = std::min(corner[axis], corner[axis] + other[axis]);
        box.max[axis] = std::max(corner[axis], corner[axis] + other[axis]);
      }
      const std::array<Box, 2> moving = recorded.moving_box(box, shutter);
      const double whole = half_area(recorded.bounds(box));
      for (unsigned k = 0; k < 40; ++k) {
        const float time = random_time(random, motion);
        const Box at = traced_box(moving, shutter, time);
        for (unsigned c = 0; c < 8; ++c)
          for (unsigned axis = 0; axis < 3; ++axis) {
            double p[3];
            for (unsigned a = 0; a < 3; ++a) p[a] = (c >> a & 1u) != 0 ? box.max[a] : box.min[a];
            const double x = recorded.coordinate(axis, p, time);
            INFO("seed " << kSeed + 2 << ", " << name_of(kind) << " motion " << i << ", time " << time << ", axis "
                         << axis);
            REQUIRE(double{at.min[axis]} <= x);
            REQUIRE(x <= double{at.max[axis]});
          }
        sum += half_area(at) / whole;
        smallest = std::min(smallest, half_area(at) / whole);
        ++count;
      }
    }
    std::printf("moving boxes: %-7s area %.3f of that for all times on average, %.4f at least\n", name_of(kind),
                sum / count, smallest);
    CHECK(smallest < 0.1);
  }
}

TEST_CASE("the moving box of a translation is as small as the box at one time") {
  build::Motion motion{.keys = {turned_key(0, {0, 0, 1}, 0, {1, 2, 3}), turned_key(1, {0, 0, 1}, 0, {101, -48, 3})}};
  const Recorded recorded(motion);
  const format_detail::Shutter shutter{0, 1};
  const std::array<Box, 2> moving = recorded.moving_box({{-1, -1, -1}, {1, 1, 1}}, shutter);
  for (const float time : {-1.0f, 0.0f, 0.25f, 0.5f, 0.75f, 1.0f, 2.0f}) {
    const Box at = traced_box(moving, shutter, time);
    CAPTURE(time);
    for (unsigned axis = 0; axis < 3; ++axis) CHECK(at.max[axis] - at.min[axis] == Approx(2).epsilon(2e-4));
    CHECK(half_area(at) < 0.03 * half_area(recorded.bounds({{-1, -1, -1}, {1, 1, 1}})));
  }
}

TEST_CASE("the range of a curve ends if its numbers are not finite") {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double bad : {kInfinity, -kInfinity, std::numeric_limits<double>::quiet_NaN()})
    for (unsigned place = 0; place < 6; ++place)
      for (const bool normalised : {false, true}) {
        MotionCurve curve{{1, 2}, {3, -1}, {2, 1}, 1.5, normalised};
        (place < 2 ? curve.e : place < 4 ? curve.g : curve.h)[place % 2] = bad;
        MotionRange range;
        curve.grow(range, 1.0);
        CAPTURE(bad, place, normalised);
        CHECK_FALSE((std::isfinite(range.low) && std::isfinite(range.high)));
      }
}

namespace {

/// Two keys of 13 numbers, a point, and the fraction of the time between the keys.
oracle::Genes random_genes(Random& random) {
  oracle::Genes genes;
  for (unsigned key = 0; key < 2; ++key) {
    for (unsigned i = 0; i < 7; ++i) genes.push_back(random.uniform_float(-1, 1));   // Translation, quaternion.
    for (unsigned i = 0; i < 3; ++i) genes.push_back(random.uniform_float(0.5, 2));  // Scale,
    for (unsigned i = 0; i < 3; ++i) genes.push_back(random.uniform_float(-1, 1));   // shear.
  }
  for (unsigned i = 0; i < 3; ++i) genes.push_back(random.uniform_float(-3, 3));
  genes.push_back(random.uniform_float(0, 1));
  return genes;
}

build::Motion motion_of(const oracle::Genes& genes, MotionKind kind) {
  build::Motion motion{.kind = kind};
  for (std::size_t key = 0; key < 2; ++key) {
    const float* gene = &genes[13 * key];
    motion.keys.push_back({.time = static_cast<float>(key),
                           .translation = {gene[0], gene[1], gene[2]},
                           .rotation = {gene[3], gene[4], gene[5], gene[6]},
                           .scale = {gene[7], gene[8], gene[9]},
                           .shear = {gene[10], gene[11], gene[12]}});
  }
  return motion;
}

/// The distance of the point from the middle of its box, in half widths: more than 1 is outside. -1: no valid motion.
/// @param moving_box the box that moves; else the box of all times.
double distance_in_box(const oracle::Genes& genes, MotionKind kind, bool moving_box) {
  for (const float gene : genes)
    if (!(std::abs(gene) < 0x1p30f)) return -1.0;
  const build::Motion motion = motion_of(genes, kind);
  if (!build::make_motion(motion)) return -1.0;
  const float s = std::clamp(genes[29], 0.0f, 1.0f);
  const Recorded recorded(motion);
  const Box of{{genes[26], genes[27], genes[28]}, {genes[26], genes[27], genes[28]}};
  const format_detail::Shutter shutter{0, 1};
  const Box box = moving_box ? traced_box(recorded.moving_box(of, shutter), shutter, s) : recorded.bounds(of);
  // By the recorded numbers, as above.
  const SegmentMotion recorded_motion(recorded.parts.segments[0], kind);
  const double point[3] = {genes[26], genes[27], genes[28]};
  double worst = 0.0;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const double low = box.min[axis], high = box.max[axis], at = recorded_motion.curve(axis, point).at(double{s}).value;
    if (!(high > low)) return -1.0;
    worst = std::max(worst, at < low || at > high ? 2.0 : std::fabs(2 * at - low - high) / (high - low));
  }
  return worst;
}

}  // namespace

TEST_CASE("no search finds a point outside of its moving box") {
  for (const bool moving_box : {false, true})
    for (const MotionKind kind : kKinds) {
      const auto score = [&](const oracle::Genes& genes) { return distance_in_box(genes, kind, moving_box); };
      const oracle::Worst worst = oracle::climb(kSeed, 20, trials(1500), random_genes, score);
      std::printf("%s%s: a point is at %.9f of half the width of its box, of random ones %.9f\n", name_of(kind),
                  moving_box ? ", moving box" : "", worst.score, worst.random);
      CHECK(worst.score <= 1.0);
      // Points that move linearly stay as far from the side as the margin for rounding.
      CHECK(worst.score > (moving_box && kind == MotionKind::kMatrix ? 0.05 : 0.9));
    }
}
