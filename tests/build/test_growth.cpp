// How the time of a build grows with the number of triangles where very many of them overlap.

#include <hiprt_build/build.h>
#include <tests/build/cpu_time.h>
#include <tests/oracle/odd_meshes.h>
#include <tools/cli/build/build_names.h>

#include <tests/catch.h>

#include <algorithm>
#include <cstdio>
#include <string>

using namespace hiprt;
using namespace hiprt::oracle;

namespace {

struct Overlapping {
  std::string name;
  Mesh (*make)(unsigned count);
};

const Overlapping kOverlapping[] = {
    {"soup", [](unsigned count) { return soup(count, 1.0, 1); }},
    {"concentric", [](unsigned count) { return concentric(count, 2); }},
    {"cables", [](unsigned count) { return cables(count, 3); }},
    {"fan", [](unsigned count) { return fan(count); }},
    {"identical", [](unsigned count) { return identical(count); }},
};

/// The shortest of some builds: other programs of the machine slow down single ones, by caches and pages.
double build_milliseconds(const Mesh& mesh, build::Builder builder, int builds) {
  double shortest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < builds; ++i) {
    const double start = test::cpu_milliseconds();
    const auto bvh = build::build(std::vector{mesh.view()}, {.builder = builder, .threads = 1});
    shortest = std::min(shortest, test::cpu_milliseconds() - start);
    REQUIRE(bvh.has_value());
  }
  return shortest;
}

}  // namespace

TEST_CASE("four times the triangles take little more than four times the time, also where very many overlap") {
  constexpr unsigned kCount = 6000;
  // Of n log n: less than 5. Of quadratic work: 16.
  constexpr double kMost = 8;
  std::printf("%-14s", "growth");
  for (const Overlapping& overlapping : kOverlapping) std::printf(" %10s", overlapping.name.c_str());
  std::printf("\n");
  for (const auto& [word, builder] : tools::kBuilders) {
    std::printf("%-14s", std::string(word).c_str());
    for (const Overlapping& overlapping : kOverlapping) {
      CAPTURE(word, overlapping.name);
      const Mesh few = overlapping.make(kCount), many = overlapping.make(4 * kCount);
      double growth = std::numeric_limits<double>::infinity();
      for (int tries = 0; tries < 5 && growth > kMost; ++tries)
        growth = std::min(growth, build_milliseconds(many, builder, 1) / build_milliseconds(few, builder, 2));
      std::printf(" %10.2f", growth);
      CHECK(growth <= kMost);
    }
    std::printf("\n");
  }
}

// Each triangle of the concentric mesh crosses all slabs of its range, and there is no room for the cuts.
TEST_CASE("spatial splits do not make parts that there is no room for") {
  constexpr unsigned kCount = 20'000;
  // 1.1 times as long; more than twice where all parts are made.
  constexpr double kMost = 2;
  const Mesh overlapping = concentric(kCount, 2), scattered = soup(kCount, 0.01, 3);
  double relative = std::numeric_limits<double>::infinity();
  for (int tries = 0; tries < 5 && relative > kMost; ++tries)
    relative = std::min(relative, build_milliseconds(overlapping, build::Builder::kSbvh, 2) /
                                      build_milliseconds(scattered, build::Builder::kSbvh, 2));
  std::printf("sbvh, concentric / scattered: %.2f\n", relative);
  CHECK(relative <= kMost);
}
