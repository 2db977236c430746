// Tree quality beside Embree's, by one cost function, and the memory of a build.

#include <hiprt_build/presplit/split_demand.h>
#include <hiprt_build/statistics.h>
#include <hiprt_device/hiprt_device.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/oracle/random.h>

#include <tests/catch.h>

#include <algorithm>
#include <optional>

using namespace hiprt;
using namespace hiprt::oracle;

namespace {

struct Built {
  double cost = 0, peak = 0;
};

Built built(const Mesh& mesh, build::Builder builder) {
  const auto bvh = build::build(std::vector{mesh.view()}, {.builder = builder});
  REQUIRE(bvh.has_value());
  const auto view = open_buffer(bvh->buffer.bytes());
  REQUIRE(view.has_value());
  return {build::measure_tree(*view).sah_cost,
          static_cast<double>(bvh->statistics.scratch_bytes_peak) / static_cast<double>(bvh->buffer.size())};
}

}  // namespace

TEST_CASE("the split budget: 1 splits nothing, more allows more references and a lower cost") {
  const Mesh mesh = soup(20000, 0.5, 5);
  const build::Builder builder = GENERATE(build::Builder::kSbvh, oracle::kEmbreeHigh);
  CAPTURE(build::name(builder));
  std::uint64_t leaves[3];
  double cost[3];
  int i = 0;
  for (const double budget : {1.0, 1.5, 3.0}) {
    const auto bvh = build::build(std::vector{mesh.view()}, {.builder = builder, .split_budget = budget});
    REQUIRE(bvh.has_value());
    const auto view = open_buffer(bvh->buffer.bytes());
    REQUIRE(view.has_value());
    leaves[i] = view->leaves.count;
    cost[i++] = build::measure_tree(*view).sah_cost;
  }
  CHECK(leaves[0] == mesh.triangles.size());
  CHECK(leaves[1] > leaves[0]);
  CHECK(static_cast<double>(leaves[1]) <= 1.5 * static_cast<double>(leaves[0]));
  CHECK(leaves[2] > leaves[1]);
  CHECK(cost[1] < cost[0]);
  CHECK(cost[2] < 1.01 * cost[1]);
}

TEST_CASE("splits as needed: boxes that are too large get a larger budget") {
  constexpr double kAny = std::numeric_limits<double>::infinity();
  const auto demand = [](unsigned factor) { return build::SplitDemand{1000ull * factor, 1000}; };
  CHECK(build::split_budget_for({0, 0}, 1.5, kAny) == 1.5);
  CHECK(build::split_budget_for(demand(1), 1.5, kAny) == 1.5);
  CHECK(build::split_budget_for(demand(16), 1.5, kAny) == 1.5);
  CHECK(build::split_budget_for(demand(64), 1.5, kAny) == 3.0);
  CHECK(build::split_budget_for(demand(64), 3.0, kAny) == 3.0);
  CHECK(build::split_budget_for(demand(100'000), 1.5, kAny) == 8.0);
  CHECK(build::split_budget_for(demand(100'000), 1.5, 4.0) == 4.0);
  CHECK(build::split_budget_for(demand(100'000), 1.5, 0.5) == 1.5);
}

TEST_CASE("splits as needed: usual scenes have the same bytes, cables a lower cost") {
  const build::Builder builder = GENERATE(build::Builder::kSbvh, build::Builder::kHq);
  CAPTURE(build::name(builder));
  const auto built = [&](const Mesh& mesh, std::optional<double> budget) {
    auto bvh = build::build(std::vector{mesh.view()}, {.builder = builder, .split_budget = budget});
    REQUIRE(bvh.has_value());
    return std::move(*bvh);
  };
  for (const Mesh& mesh : {soup(3000, 0.5, 5), icosphere(4), torus(60, 40, 0.3), Mesh{}, identical(10)}) {
    const build::Bvh usual = built(mesh, {}), as_needed = built(mesh, build::kSplitsAsNeeded);
    CHECK(std::ranges::equal(usual.buffer.bytes(), as_needed.buffer.bytes()));
  }
  const Mesh mesh = cables(10000, 7);
  const build::Bvh usual = built(mesh, {}), as_needed = built(mesh, build::kSplitsAsNeeded);
  const auto cost = [](const build::Bvh& bvh) {
    return build::measure_tree(*open_buffer(bvh.buffer.bytes())).sah_cost;
  };
  const double part = builder == build::Builder::kSbvh ? 0.5 : 0.85;
  CHECK(cost(as_needed) < part * cost(usual));
  CHECK(as_needed.statistics.leaves <= 8 * mesh.triangles.size());
  CHECK(as_needed.statistics.leaves > 4 * mesh.triangles.size());
  Random random(9);
  for (unsigned i = 0; i < 500; ++i) {
    const Position from = random.in_cube(1.5), to = random.in_cube(1.0);
    const Ray ray{{from[0], from[1], from[2]}, 0, {to[0] - from[0], to[1] - from[1], to[2] - from[2]}};
    const Hit expected = closest_hit(usual.scene(), ray), hit = closest_hit(as_needed.scene(), ray);
    REQUIRE(hit.t == expected.t);
    REQUIRE(hit.primitive == expected.primitive);
  }
}

TEST_CASE("quality levels: each names its builder, and each has a lower cost than the previous one") {
  using build::Quality;
  const Mesh mesh = soup(20000, 0.5, 5);
  double last = std::numeric_limits<double>::infinity();
  for (const auto& [quality, word, builder] : {std::tuple(Quality::kFast, "fast", build::Builder::kLbvh),
                                               std::tuple(Quality::kBalanced, "balanced", build::Builder::kSbvh),
                                               std::tuple(Quality::kHigh, "high", build::Builder::kHq)}) {
    CAPTURE(word);
    CHECK(build::name(quality) == std::string(word));
    CHECK(build::options_for(quality).builder == builder);
    const double cost = built(mesh, builder).cost;
    CHECK(cost < last);
    last = cost;
  }
}

TEST_CASE(
    "SAH costs compared with Embree's medium quality: sah 5 %, hploc 15 %, lbvh 25 %; memory within 4 times the "
    "output") {
  std::printf("%-12s %8s %8s %8s %8s %8s %8s %8s %6s\n", "mesh", "sah", "lbvh", "ploc", "hploc", "low", "medium",
              "high", "peak");
  for (const auto& [name, mesh] :
       {std::pair("icosphere", icosphere(6)), std::pair("torus", torus(200, 100, 0.4)), std::pair("star", star(6, 2)),
        std::pair("box", subdivided_box(60, 1.1, 3)), std::pair("soup", soup(50000, 0.05, 4)),
        std::pair("large soup", soup(20000, 0.5, 5)), std::pair("needles", needles(20000, 1e3, 6)),
        std::pair("plane", grid_plane(200, 2, 0.5f))}) {
    const Built ours = built(mesh, build::Builder::kSah);
    const Built lbvh = built(mesh, build::Builder::kLbvh), ploc = built(mesh, build::Builder::kPloc),
                hploc = built(mesh, build::Builder::kHploc);
    const Built low = built(mesh, oracle::kEmbreeLow), medium = built(mesh, oracle::kEmbreeMedium),
                high = built(mesh, oracle::kEmbreeHigh);
    std::printf("%-12s %8.2f %8.2f %8.2f %8.2f %8.2f %8.2f %8.2f %6.2f\n", name, ours.cost, lbvh.cost, ploc.cost,
                hploc.cost, low.cost, medium.cost, high.cost, ours.peak);
    CHECK(ours.cost <= 1.05 * medium.cost);
    // "plane": on regular grids, joining the nearest boxes first gives the worst tree.
    CHECK(hploc.cost <= 1.15 * medium.cost);
    CHECK(hploc.cost <= 1.05 * ploc.cost);
    CHECK(lbvh.cost <= 1.25 * medium.cost);
    for (const Built& each : {ours, lbvh, ploc, hploc, low, medium, high}) CHECK(each.peak <= 4);
  }
}
