// Spheres and round linear curves against exact crossings: decisions, t, error bounds, normals, parameters.

#include <tests/primitives/measure.h>
#include <tests/primitives/naive.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20270214;

/// The bounds of the documentation (SphereSet, RoundCurveSet, decision record 0009).
void check(const Findings& f) {
  INFO(f.first_failure);
  CHECK(f.odd_counts == 0);
  CHECK(f.out_of_order == 0);
  CHECK(f.wrong == 0);
  CHECK(f.slack <= kSlack * 0x1p53);
  CHECK(f.surface <= 1);
  CHECK(f.normal <= 8);
  CHECK(f.parameter <= 0x1p-22);
}

void measure_all(const char* title, const Scales& scales, std::uint64_t seed, unsigned count) {
  INFO("seed " << seed << ": " << title);
  std::printf("\n%s; sizes times %g to %g, directions times %g to %g\n", title, 1 / scales.sizes, scales.sizes,
              1 / scales.directions, scales.directions);
  std::printf("%-15s %8s %8s %6s %7s | t, ulps: %6s %6s %6s | %6s %7s %6s %6s\n", "shape", "cases", "hits", "wrong",
              "in band", "median", "99.9 %", "max", "slack", "surface", "bound", "normal");
  Findings everything;
  for (const Shape shape : kShapes) {
    Findings sum;
    for (const Aim aim : kAims) sum.add(measure_many(shape, aim, scales, seed, count));
    INFO(name(shape));
    std::printf("%-15s %8lu %8lu %6lu %7lu |          %6.3f %6.3f %6.3f | %6.2f %7.3f %6.1f %6.2f\n", name(shape),
                sum.cases, sum.hits, sum.wrong, sum.in_band, sum.quantile(0.5), sum.quantile(0.999), sum.quantile(1),
                sum.slack, sum.surface, sum.bound, sum.normal);
    check(sum);
    CHECK(sum.hits > sum.cases / 10);
    CHECK(sum.quantile(0.5) <= 0.3);
    CHECK(sum.quantile(0.999) <= 0.51);
    CHECK(sum.quantile(1) <= 2);
    CHECK(sum.bound <= 36);
    everything.add(std::move(sum));
  }
  std::printf("widest wrong decision: a line within %.3g sizes of a tangent\n", everything.widest_band);
}

}  // namespace

TEST_CASE("near origins", "[primitives]") { measure_all("origins within 10 sizes", Scales{}, kSeed, trials(8000)); }

TEST_CASE("far origins", "[primitives]") {
  measure_all("origins up to 1e7 sizes away", Scales{.distance = 1e7}, kSeed + 1, trials(4000));
}

TEST_CASE("far from the coordinates' origin", "[primitives]") {
  measure_all("moved by 1e3 sizes", Scales{.offset = 1e3, .distance = 1e3}, kSeed + 2, trials(4000));
}

TEST_CASE("sizes near the ends of float", "[primitives]") {
  measure_all("directions in sizes", {.sizes = 1e28, .directions = 1e5, .per_size = true}, kSeed + 3, trials(4000));
}

TEST_CASE("the measurement finds the errors of a textbook's test", "[primitives]") {
  INFO("seed " << kSeed + 4);
  std::printf("\n(-b -+ sqrt(b^2 - a c)) / a in float, sizes 1: decided wrongly, errors of t\n");
  for (const double distance : {10.0, 1e3, 1e5, 1e7}) {
    Findings sum;
    for (const Aim aim : kAims)
      sum.add(measure_many(Shape::kSphere, aim, {.distance = distance, .sizes = 1, .directions = 1}, kSeed + 4,
                           trials(4000), NaiveSphere{}));
    std::printf("origins within %g sizes: %lu of %lu wrong; ulps median %.3g, 99.9 %% %.3g, max %.3g\n", distance,
                sum.wrong, sum.cases, sum.quantile(0.5), sum.quantile(0.999), sum.quantile(1));
    CHECK(sum.wrong > 0);
    CHECK(sum.surface > 1);
    CHECK(sum.quantile(0.999) > 2);
  }
}
