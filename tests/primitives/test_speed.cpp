// Times of the custom primitives' tests. Hidden, because a time is no pass or fail: run it with the tag [.speed].

#include <tests/primitives/measure.h>
#include <tests/primitives/naive.h>

#include <tests/catch.h>

#include <chrono>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20270401;
constexpr unsigned kCases = 4096, kRounds = 100;

/// Rays that hit (or pass) the primitive, of size 1.
std::vector<Case> cases_of(Shape shape, bool hit) {
  Random random(kSeed);
  std::vector<Case> result;
  while (result.size() < kCases) {
    Case c = random_case(shape, hit ? Aim::kInner : Aim::kBeside, Scales{}, random);
    bool found = false;
    intersect(c, c.ray, [&](const CustomHit&) { return !(found = true); });
    if (found == hit) result.push_back(c);
  }
  return result;
}

/// @return nanoseconds per test, which stops at the first crossing: the best of five.
template <class Intersect> double time_of(const std::vector<Case>& cases, const Intersect& intersects) {
  double best = 1e30;
  float sum = 0;
  for (int repeat = 0; repeat < 5; ++repeat) {
    const auto start = std::chrono::steady_clock::now();
    for (unsigned round = 0; round < kRounds; ++round)
      for (const Case& c : cases)
        intersects(c, c.ray, [&](const CustomHit& hit) {
          sum += hit.t + hit.normal.x + hit.error;
          return false;
        });
    const std::chrono::duration<double, std::nano> took = std::chrono::steady_clock::now() - start;
    best = std::min(best, took.count() / (double{kRounds} * kCases));
  }
  CHECK(sum == sum);
  return best;
}

}  // namespace

TEST_CASE("time per test", "[.speed]") {
  std::printf("\n%-15s %10s %10s   (ns)\n", "", "hit", "miss");
  std::printf("%-15s %10.1f %10.1f\n", "naive sphere", time_of(cases_of(Shape::kSphere, true), NaiveSphere{}),
              time_of(cases_of(Shape::kSphere, false), NaiveSphere{}));
  for (const Shape shape : {Shape::kSphere, Shape::kCylinder, Shape::kCone, Shape::kTip, Shape::kHeld})
    std::printf("%-15s %10.1f %10.1f\n", name(shape), time_of(cases_of(shape, true), Ours{}),
                time_of(cases_of(shape, false), Ours{}));
}
