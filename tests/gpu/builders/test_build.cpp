// Builds on the device: the files equal those of the CPU's builders, bit for bit, where both make the same pairs.

#include <hiprt_build/collapse/collapse_plan.h>
#include <hiprt_build/statistics.h>
#include <hiprt_device/format/widened_boxes.h>
#include <tests/gpu/builders/build_input.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/odd_meshes.h>

#include <cstdio>
#include <limits>
#include <string>

using namespace hiprt;
using namespace hiprt::checks;
using build::Builder;
using Catch::Matchers::Contains;

namespace {

/// Without pairs, which the host looks for in the whole mesh.
void check_like_host(Input& input, Builder builder, NodeLayout nodes = NodeLayout::kPlanes, unsigned run = 8) {
  INFO(build::name(builder) << ", runs of " << run);
  gpu::BuildReport report;
  const build::Buffer device = input.build_on_device({.builder = builder,
                                                      .nodes = nodes,
                                                      .max_leaf_triangles = run,
                                                      .pair_triangles = false,
                                                      .widen_boxes = may_be_widened(nodes)},
                                                     &report);
  const build::Bvh host = input.build_on_host({.builder = builder,
                                               .nodes = nodes,
                                               .max_leaf_triangles = run,
                                               .pair_triangles = false,
                                               .widen_boxes = may_be_widened(nodes)});
  check_same_files(device, host.buffer);
  CHECK(report.dropped_not_finite == host.statistics.dropped_not_finite);
  CHECK(report.dropped_degenerate == host.statistics.dropped_degenerate);
  CHECK(report.leaves == host.statistics.leaves);
  CHECK(report.nodes == host.statistics.nodes);
}

constexpr Builder kBuilders[] = {Builder::kLbvh, Builder::kLbvh30, Builder::kHploc};

}  // namespace

TEST_CASE("trees of the device equal the host's, bit by bit") {
  INFO("seed " << kSeed);
  for (const unsigned count : {0u, 1u, 2u, 3u, 7u, 31u, 32u, 33u, 63u, 64u, 65u, 500u, 4097u}) {
    INFO(count << " triangles");
    Input input({oracle::first_triangles(oracle::soup(std::max(count, 1u), 0.1, kSeed), count)});
    for (const Builder builder : kBuilders) check_like_host(input, builder);
  }
  Input star({oracle::star(4, kSeed)});
  for (const Builder builder : kBuilders)
    for (const unsigned run : {1u, 2u, 64u}) check_like_host(star, builder, NodeLayout::kFloat, run);
}

TEST_CASE("trees of H-PLOC with other radii equal the host's") {
  Input input({oracle::soup(900, 0.2, kSeed)});
  double costs[3];
  unsigned i = 0;
  for (const unsigned radius : {1u, 8u, 128u}) {
    INFO("radius " << radius);
    const build::Buffer device =
        input.build_on_device({.builder = Builder::kHploc, .ploc_radius = radius, .pair_triangles = false});
    check_same_files(
        device,
        input.build_on_host({.builder = Builder::kHploc, .ploc_radius = radius, .pair_triangles = false}).buffer);
    costs[i++] = build::measure_tree(checked_view(device), {}).sah_cost;
  }
  CHECK(costs[1] < costs[0]);
  CHECK(costs[2] != costs[1]);
}

TEST_CASE("every layout is written on the device as on the host") {
  INFO("seed " << kSeed);
  Input star({oracle::star(3, kSeed)}), soup({oracle::soup(900, 0.2, kSeed)}),
      far({oracle::placed(oracle::soup(300, 0.2, kSeed), 1e6)}), one({oracle::soup(1, 0.2, kSeed)});
  for (const NodeLayout nodes : {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized}) {
    INFO("layout " << static_cast<unsigned>(nodes));
    for (Input* input : {&star, &soup, &far, &one}) check_like_host(*input, Builder::kHploc, nodes);
  }
  CountingAllocator allocator;
  Input beyond({oracle::placed(oracle::soup(30, 0.2, kSeed), 2e38)});
  CHECK_THAT(
      error_of(gpu::build_scene(beyond.geometries, {.nodes = NodeLayout::kQuantized}, nullptr, allocator)).message,
      Contains("a coordinate of 2^126"));
}

TEST_CASE("odd meshes build on the device as on the host") {
  INFO("seed " << kSeed);
  const oracle::Mesh meshes[] = {oracle::torture(700, kSeed), oracle::identical(300), oracle::concentric(200, kSeed),
                                 oracle::needles(500, 1e4, kSeed), oracle::grid_plane(20, 1, 0.5f)};
  for (std::size_t m = 0; m < std::size(meshes); ++m) {
    INFO("mesh " << m);
    Input input({meshes[m]});
    for (const Builder builder : kBuilders) check_like_host(input, builder);
  }
}

TEST_CASE("several geometries, masks and custom primitives") {
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  std::vector<Box> boxes(333);
  for (Box& box : boxes) {
    const oracle::Position low = random.in_cube(1), size = random.in_cube(0.1);
    for (unsigned axis = 0; axis < 3; ++axis) {
      box.min[axis] = low[axis];
      box.max[axis] = low[axis] + std::abs(size[axis]);
    }
  }
  boxes[5].max[1] = std::numeric_limits<float>::quiet_NaN();
  boxes[7].max[0] = boxes[7].min[0] - 1;
  std::vector<oracle::Mesh> meshes;
  for (unsigned i = 0; i < 70; ++i) meshes.push_back(oracle::soup(i % 7, 0.2, kSeed + i));
  meshes[3].mask = 5;
  Input mixed(meshes, {boxes, {}, boxes}), customs({}, {boxes}), empty({}), hollow({oracle::Mesh{}});
  for (const Builder builder : kBuilders) {
    check_like_host(mixed, builder);
    check_like_host(customs, builder);
    check_like_host(empty, builder);
    check_like_host(hollow, builder);
  }
}

TEST_CASE("pairs of the device equal the host's") {
  INFO("seed " << kSeed);
  Input star({oracle::star(4, kSeed)}), torus({oracle::torus(60, 30, 0.3)}), plane({oracle::grid_plane(40, 2, 0)});
  // What shares an edge is far apart in the index buffer, and in one of two geometries.
  Input far({oracle::scattered(oracle::icosphere(4), kSeed), oracle::scattered(oracle::grid_plane(30, 1, 0), kSeed)});
  for (Input* input : {&star, &torus, &plane, &far}) {
    gpu::BuildReport report;
    const build::Buffer device = input->build_on_device({}, &report);
    const build::Bvh host = input->build_on_host({.builder = Builder::kHploc});
    const double device_cost = build::measure_tree(checked_view(device), {}).sah_cost;
    const double host_cost = build::measure_tree(checked_view(host.buffer), {}).sah_cost;
    std::printf("pairs: device %u, host %u; SAH cost: device %.3f, host %.3f\n", report.pairs,
                static_cast<unsigned>(host.statistics.pairs), device_cost, host_cost);
    CHECK(report.pairs > host.statistics.pairs * 9 / 10);
    CHECK(device_cost < 1.05 * host_cost);
    const build::Buffer again = input->build_on_device({});
    CHECK(std::equal(again.bytes().begin(), again.bytes().end(), device.bytes().begin(), device.bytes().end()));
  }
}

TEST_CASE("trees too deep for a ray's stack are rebuilt by LBVH") {
  INFO("seed " << kSeed);
  const std::vector<oracle::Mesh> meshes[] = {{oracle::nested(130, kSeed)}, {oracle::nested(200, kSeed)}};
  for (const std::vector<oracle::Mesh>& mesh : meshes) {
    const bool too_deep = mesh[0].triangles.size() > 130;
    INFO(mesh[0].triangles.size() << " triangles");
    Input input(mesh);
    for (const unsigned run : {1u, 8u}) {
      gpu::BuildReport report;
      const build::Buffer file = input.build_on_device({.max_leaf_triangles = run, .pair_triangles = false}, &report);
      CHECK(report.status == gpu::BuildStatus::kOk);
      CHECK(report.builder == (too_deep ? Builder::kLbvh : Builder::kHploc));
      const BufferView view = checked_view(file);
      // Narrow nodes alone are enough for this one.
      if (!too_deep) CHECK(view.header->stack_bound > build::kWideStackNeed);
      if (too_deep)
        check_same_files(
            file, input.build_on_host({.builder = Builder::kLbvh, .max_leaf_triangles = run, .pair_triangles = false})
                      .buffer);
      CHECK(check_hits(make_scene_view(view), mesh) > 100);
    }
  }
}

TEST_CASE("inputs that the device cannot build are refused") {
  CountingAllocator allocator;
  const auto message = [&](const gpu::DeviceGeometry& geometry, const gpu::BuildOptions& options) {
    return error_of(gpu::build_scene({&geometry, 1}, options, nullptr, allocator)).message;
  };
  const gpu::DeviceGeometry none{};
  CHECK_THAT(message(none, {.builder = Builder::kEmbreeHigh}),
             Contains(oracle::kHasEmbree ? "builder embree-high does not run on the GPU" : "embree-high needs Embree"));
  CHECK_THAT(message(none, {.split_budget = 0.5}), Contains("split_budget is 0.5, allowed are 1 to 16"));
  CHECK_THAT(message(none, {.presplit_budget = 17}), Contains("presplit_budget is 17, allowed are 1 to 16"));
  CHECK_THAT(message(none, {.reinsertion_rounds = 1001}),
             Contains("reinsertion_rounds is 1001, allowed are 0 to 1000"));
  CHECK_THAT(message(none, {.ploc_radius = 129}), Contains("ploc_radius is 129, allowed are 1 to 128"));
  CHECK_THAT(message(none, {.max_leaf_triangles = 65}), Contains("max_leaf_triangles is 65"));
  CHECK_THAT(message(none, {.nodes = static_cast<NodeLayout>(5)}), Contains("node layout 5 cannot be written"));
  CHECK_THAT(message(none, {.costs = {.leaf = 0}}), Contains("SAH costs must be positive"));
  CHECK_THAT(message({.primitive_count = 1}, {}), Contains("geometry 0: 1 primitives need positions and triangles"));
  const Box box{};
  CHECK_THAT(message({.boxes = &box, .primitive_count = gpu::kMaxBuildPrimitives + 1}, {}),
             Contains("268435455 primitives, the limit is 268435454"));
  const gpu::DeviceGeometry many{.boxes = &box, .primitive_count = 200000000};
  CHECK_THAT(error_of(gpu::build_sizes({&many, 1})).message, Contains("a node reference addresses"));
  oracle::Mesh bad = oracle::soup(40, 0.1, kSeed);
  bad.triangles[33][1] = 1000;
  Input input({bad});
  CHECK_THAT(error_of(gpu::build_scene(input.geometries, {}, nullptr, allocator)).message,
             Contains("1 triangles have an index beyond"));
  CHECK(allocator.balance() == 0);
}

TEST_CASE("sizes with capacity for splits are known before the build, or refused") {
  const build::Position position{};
  const build::Triangle triangle{};
  for (const Builder builder : {Builder::kHploc, Builder::kPloc, Builder::kSbvh, Builder::kHq})
    for (const std::uint32_t count : {1u, 1000u, 1000000u, 30000000u, gpu::kMaxBuildPrimitives}) {
      const gpu::DeviceGeometry geometry{
          .positions = &position, .triangles = &triangle, .position_count = 1, .primitive_count = count};
      const auto sizes =
          gpu::build_sizes({&geometry, 1}, {.builder = builder, .presplit_budget = 1.5, .reinsertion_rounds = 2});
      INFO(build::name(builder) << ", " << count << " triangles");
      if (count == gpu::kMaxBuildPrimitives) {
        CHECK_THAT(error_of(sizes).message, Contains("a node reference addresses"));
        continue;
      }
      REQUIRE(sizes.has_value());
      const std::uint64_t halves = builder == Builder::kHq ? 6 : builder == Builder::kSbvh ? 3 : 2;
      const std::uint64_t capacity = std::uint64_t{count} * 3 / 2 * halves / 2;
      CHECK(sizes->output >= capacity * 192);
      CHECK(sizes->scratch >= capacity * 96);
    }
}

TEST_CASE("sizes are known before the build") {
  const Box box{};
  for (const std::uint32_t count : {0u, 1u, 1000u, 1000000u, 100000000u}) {
    const gpu::DeviceGeometry geometry{.boxes = &box, .primitive_count = count};
    const gpu::BuildSizes sizes = must(gpu::build_sizes({&geometry, 1}));
    INFO(count << " primitives: output " << sizes.output << ", scratch " << sizes.scratch);
    if (count >= 1000000) CHECK(sizes.scratch <= std::uint64_t{64} * count + 4096);
    CHECK(sizes.output >= std::uint64_t{197} * count);
    CHECK(sizes.output <= std::uint64_t{197} * count + 4096);
  }
}
