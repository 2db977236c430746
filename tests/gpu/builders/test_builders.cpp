// Builders whose device trees may differ from the host's: the files are valid, the cost is as low, and the hits are
// those of brute force.

#include <hiprt_build/statistics.h>
#include <tests/gpu/builders/build_input.h>
#include <tests/oracle/odd_meshes.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;
using build::Builder;

namespace {

double cost_of(const build::Buffer& file) { return build::measure_tree(checked_view(file), {}).sah_cost; }

/// A builder with options.
struct Configuration {
  const char* name;
  gpu::BuildOptions options;
};

const Configuration kConfigurations[] = {
    {"ploc", {.builder = Builder::kPloc}},
    {"sah", {.builder = Builder::kSah}},
    {"sbvh", {.builder = Builder::kSbvh}},
    {"sbvh, budget 3", {.builder = Builder::kSbvh, .split_budget = 3}},
    {"hq", {.builder = Builder::kHq}},
    {"lbvh, reinsertion", {.builder = Builder::kLbvh, .reinsertion_rounds = 3}},
    {"hploc, pre-splits", {.builder = Builder::kHploc, .presplit_budget = 1.5}},
    {"hploc, pre-splits, reinsertion", {.builder = Builder::kHploc, .presplit_budget = 1.5, .reinsertion_rounds = 8}},
    {"ploc, pre-splits", {.builder = Builder::kPloc, .presplit_budget = 1.2}},
    {"sbvh, pre-splits, reinsertion", {.builder = Builder::kSbvh, .presplit_budget = 1.3, .reinsertion_rounds = 1}},
};

build::BuildOptions on_host(const gpu::BuildOptions& options) {
  return {.builder = options.builder,
          .nodes = options.nodes,
          .split_budget = options.split_budget,
          .presplit_budget = options.presplit_budget,
          .reinsertion_rounds = options.reinsertion_rounds,
          .max_leaf_triangles = options.max_leaf_triangles,
          .pair_triangles = options.pair_triangles};
}

/// Without pairs, which the host looks for in the whole mesh.
void check_configuration(const Configuration& configuration, const std::vector<oracle::Mesh>& meshes, double most_above,
                         unsigned least_hits) {
  INFO(configuration.name);
  Input input(meshes);
  gpu::BuildOptions options = configuration.options;
  options.pair_triangles = false;
  gpu::BuildReport report;
  const build::Buffer device = input.build_on_device(options, &report);
  const build::Bvh host = input.build_on_host(on_host(options));
  CHECK(report.status == gpu::BuildStatus::kOk);
  CHECK(report.dropped_not_finite == host.statistics.dropped_not_finite);
  CHECK(report.dropped_degenerate == host.statistics.dropped_degenerate);
  const double device_cost = cost_of(device), host_cost = cost_of(host.buffer);
  std::printf("%-32s %6zu triangles: leaves %6u, host %6u; SAH cost %9.3f, host %9.3f\n", configuration.name,
              meshes[0].triangles.size(), report.leaves, static_cast<unsigned>(host.statistics.leaves), device_cost,
              host_cost);
  CHECK(device_cost <= host_cost * (1 + most_above));
  CHECK(check_hits(make_scene_view(checked_view(device)), meshes) >= least_hits);
  const build::Buffer again = input.build_on_device(options);
  CHECK(std::equal(again.bytes().begin(), again.bytes().end(), device.bytes().begin(), device.bytes().end()));
}

}  // namespace

TEST_CASE("every builder, with pre-splits and reinsertion, on the device") {
  INFO("seed " << kSeed);
  for (const Configuration& configuration : kConfigurations) {
    check_configuration(configuration, {oracle::soup(700, 0.3, kSeed)}, 0.05, 100);
    for (const unsigned count : {0u, 1u, 2u, 3u, 9u, 33u}) {
      check_configuration(configuration,
                          {oracle::first_triangles(oracle::soup(std::max(count, 1u), 0.1, kSeed), count)}, 0.05, 0);
    }
  }
}

TEST_CASE("odd meshes, every builder, on the device") {
  INFO("seed " << kSeed);
  const oracle::Mesh meshes[] = {oracle::torture(400, kSeed), oracle::identical(150), oracle::concentric(100, kSeed),
                                 oracle::placed(oracle::soup(100, 0.3, kSeed), 1e37),
                                 oracle::placed(oracle::soup(100, 0.3, kSeed), 1e-38)};
  for (std::size_t m = 0; m < std::size(meshes); ++m) {
    INFO("mesh " << m);
    // Where sums of areas are infinite, ranges are halved in the order in which they lie.
    for (const Configuration& configuration : {kConfigurations[0], kConfigurations[2], kConfigurations[7]})
      check_configuration(configuration, {meshes[m]}, m == 0 ? 0.6 : 0.25, 0);
  }
}

TEST_CASE("split triangles are covered and cost as much as the host's") {
  INFO("seed " << kSeed);
  const oracle::Mesh mesh = oracle::needles(600, 1e3, kSeed);
  for (const Configuration& configuration :
       {kConfigurations[3], kConfigurations[4], kConfigurations[7], kConfigurations[9]})
    check_configuration(configuration, {mesh}, 0.05, 0);
}

TEST_CASE("pre-splits equal the host's") {
  INFO("seed " << kSeed);
  for (const oracle::Mesh& mesh : {oracle::needles(300, 1e4, kSeed), oracle::soup(600, 0.4, kSeed)})
    for (const double budget : {1.1, 4.0}) {
      Input input({mesh});
      const gpu::BuildOptions options{.builder = Builder::kHploc, .presplit_budget = budget, .pair_triangles = false};
      gpu::BuildReport report;
      const build::Buffer device = input.build_on_device(options, &report);
      const build::Bvh host = input.build_on_host(on_host(options));
      CHECK(report.leaves == host.statistics.leaves);
      CHECK(report.leaves > mesh.triangles.size());
      check_same_files(device, host.buffer);
    }
}

TEST_CASE("layouts of trees with split triangles") {
  INFO("seed " << kSeed);
  const std::vector<oracle::Mesh> meshes{oracle::needles(300, 100, kSeed)};
  Input input(meshes);
  for (const NodeLayout nodes : {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized}) {
    INFO("layout " << static_cast<unsigned>(nodes));
    const gpu::BuildOptions options{.builder = Builder::kHploc, .nodes = nodes, .presplit_budget = 2};
    const build::Buffer device = input.build_on_device(options);
    CHECK(cost_of(device) <= 1.05 * cost_of(input.build_on_host(on_host(options)).buffer));
    check_hits(make_scene_view(checked_view(device)), meshes);
  }
}

TEST_CASE("builds are cancelled before each step, and leak nothing") {
  Input input({oracle::soup(200, 0.3, kSeed)});
  CountingAllocator allocator;
  gpu::BuildOptions options{.builder = Builder::kHploc, .presplit_budget = 1.5, .reinsertion_rounds = 1};
  std::vector<std::string> steps;
  double before = 0;
  options.progress = [&](const build::Progress& progress) {
    CHECK(progress.fraction >= before);
    before = progress.fraction;
    steps.emplace_back(progress.step);
    return true;
  };
  REQUIRE(gpu::build_scene(input.geometries, options, nullptr, allocator).has_value());
  CHECK(steps == std::vector<std::string>{"pair", "cut", "sort", "tree", "reinsert", "collapse", "encode"});
  for (const std::string& last : steps) {
    options.progress = [&](const build::Progress& progress) { return progress.step != last; };
    const build::Error error = error_of(gpu::build_scene(input.geometries, options, nullptr, allocator));
    CHECK(error.code == build::ErrorCode::kCancelled);
    CHECK(error.message == "the build was cancelled before step " + last);
  }
  CHECK(allocator.balance() == 0);
}

TEST_CASE("custom primitives are not split") {
  oracle::Random random(kSeed);
  std::vector<Box> boxes(100);
  for (Box& box : boxes) {
    const oracle::Position low = random.in_cube(1);
    for (unsigned axis = 0; axis < 3; ++axis) {
      box.min[axis] = low[axis];
      box.max[axis] = low[axis] + 0.1f;
    }
  }
  Input mixed({oracle::needles(200, 100, kSeed)}, {boxes});
  for (const Configuration& configuration : kConfigurations) {
    INFO(configuration.name);
    gpu::BuildReport report;
    gpu::BuildOptions options = configuration.options;
    options.pair_triangles = false;
    const build::Buffer device = mixed.build_on_device(options, &report);
    CHECK(report.leaves == 300);
    CHECK(report.custom_leaves == 100);
    CHECK(cost_of(device) <= 1.05 * cost_of(mixed.build_on_host(on_host(options)).buffer));
  }
}
