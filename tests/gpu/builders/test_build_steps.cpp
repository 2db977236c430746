// Builds in steps: the scenes of enqueue_build(), in memory of the size that they need.

#include <hiprt_build/gpu/build_steps.h>
#include <hiprt_build/presplit/split_demand.h>
#include <tests/gpu/builders/build_as_if_large.h>
#include <tests/gpu/builders/build_input.h>
#include <tests/oracle/odd_meshes.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;
using build::Builder;
using Catch::Matchers::Contains;

namespace {

constexpr Builder kBuilders[] = {Builder::kLbvh, Builder::kLbvh30, Builder::kPloc, Builder::kHploc,
                                 Builder::kSah,  Builder::kSbvh,   Builder::kHq};
constexpr NodeLayout kLayouts[] = {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized};

/// Memory in which nothing is zero.
gpu::DeviceBuffer dirty(std::size_t bytes, gpu::Allocator& allocator) {
  auto buffer = must(gpu::DeviceBuffer::make(bytes, nullptr, allocator));
  must(buffer.fill(std::byte{0xa5}, nullptr));
  return buffer;
}

/// What a build left, and the most memory that its steps held.
struct Stepped {
  std::vector<std::byte> file;
  gpu::BuildReport report;
  std::size_t most = 0;
};

std::vector<std::byte> bytes_of(const gpu::DeviceBuffer& buffer) {
  std::vector<std::byte> bytes(buffer.size());
  must(buffer.download(bytes, nullptr));
  REQUIRE(hipStreamSynchronize(nullptr) == hipSuccess);
  return bytes;
}

Stepped in_steps(std::span<const gpu::DeviceGeometry> geometries, const gpu::BuildOptions& options) {
  CountingAllocator allocator;
  auto steps = must(gpu::BuildSteps::make(geometries, options));
  gpu::DeviceBuffer scene;
  unsigned count = 0;
  while (!steps.done()) {
    gpu::DeviceBuffer output = dirty(steps.sizes().output, allocator),
                      scratch = dirty(steps.sizes().scratch, allocator);
    must(steps.enqueue(output.data(), scratch.data(), nullptr));
    must(steps.wait());
    scene = std::move(output);
    ++count;
  }
  CHECK((count == 3 || count == 4));
  CHECK(steps.report().view.base == scene.data());
  CHECK(steps.report().view.size == scene.size());
  return {bytes_of(scene), steps.report(), allocator.most};
}

/// @param enqueue enqueue_build(), or what takes as much memory.
template <class Enqueue>
std::vector<std::byte> at_once(std::span<const gpu::DeviceGeometry> geometries, const gpu::BuildOptions& options,
                               const Enqueue& enqueue) {
  CountingAllocator allocator;
  const gpu::BuildSizes sizes = must(gpu::build_sizes(geometries, options));
  gpu::DeviceBuffer output = dirty(sizes.output, allocator), scratch = dirty(sizes.scratch, allocator);
  const auto* report = must(enqueue(geometries, options, output.data(), scratch.data()));
  return bytes_of(must(gpu::compact(report, nullptr, allocator)).buffer);
}
std::vector<std::byte> at_once(std::span<const gpu::DeviceGeometry> geometries, const gpu::BuildOptions& options) {
  return at_once(geometries, options,
                 [](const auto&... arguments) { return gpu::enqueue_build(arguments..., nullptr); });
}

void check_same(Input& input, const gpu::BuildOptions& options) {
  INFO(build::name(options.builder) << ", layout " << static_cast<unsigned>(options.nodes));
  const Stepped stepped = in_steps(input.geometries, options);
  const std::vector<std::byte> expected = at_once(input.geometries, options);
  REQUIRE(stepped.file.size() == expected.size());
  CHECK(stepped.file == expected);
}

std::vector<Box> boxes(unsigned count) {
  oracle::Random random(kSeed);
  std::vector<Box> result(count);
  for (Box& box : result) {
    const oracle::Position low = random.in_cube(1);
    for (unsigned axis = 0; axis < 3; ++axis) box.min[axis] = low[axis], box.max[axis] = low[axis] + 0.1f;
  }
  return result;
}

}  // namespace

TEST_CASE("scenes in steps equal those at once") {
  INFO("seed " << kSeed);
  Input paired({oracle::torus(20, 16, 0.3), oracle::soup(300, 0.2, kSeed)});
  for (const Builder builder : kBuilders) check_same(paired, {.builder = builder});
  Input mixed({oracle::star(2, kSeed)}, {boxes(40), {}});
  for (const Builder builder : {Builder::kHploc, Builder::kSbvh})
    for (const NodeLayout nodes : kLayouts) check_same(mixed, {.builder = builder, .nodes = nodes});
  Input needles({oracle::needles(150, 100, kSeed)});
  for (const NodeLayout nodes : kLayouts)
    check_same(needles, {.builder = Builder::kHploc, .nodes = nodes, .presplit_budget = 2});
  check_same(needles, {.builder = Builder::kHploc, .pair_triangles = false});
  // With equal keys the order of the triangles counts.
  Input equal({oracle::identical(300)});
  for (const Builder builder : {Builder::kLbvh, Builder::kHploc, Builder::kPloc})
    check_same(equal, {.builder = builder, .pair_triangles = false});
  check_same(needles, {.nodes = NodeLayout::kFloat, .widen_boxes = true});
}

TEST_CASE("splits as needed: the budget of the CPU, counted on the device") {
  INFO("seed " << kSeed);
  // Single triangles, so that both sides measure the same leaves.
  gpu::BuildOptions options{.builder = Builder::kSbvh, .pair_triangles = false};
  Input cables({oracle::cables(300, kSeed)}), usual({oracle::soup(300, 0.2, kSeed)});
  const std::size_t before = in_steps(cables.geometries, options).file.size();
  options.split_budget = build::kSplitsAsNeeded;
  const Stepped as_needed = in_steps(cables.geometries, options), same = in_steps(usual.geometries, options);
  CHECK(as_needed.file.size() > before + before / 4);
  // At once there is no time to count.
  CHECK((at_once(usual.geometries, options) == same.file));
  CHECK(at_once(cables.geometries, options).size() == before);
  options.split_budget.reset();
  CHECK((in_steps(usual.geometries, options).file == same.file));

  build::SplitDemand demand{};
  const oracle::Mesh mesh = oracle::cables(300, kSeed);
  const auto corner = [&](std::uint32_t i) {
    return build::Point{{mesh.positions[i][0], mesh.positions[i][1], mesh.positions[i][2]}};
  };
  Box bounds = format_detail::empty_box();
  for (std::uint32_t i = 0; i < mesh.positions.size(); ++i) build::grow(bounds, corner(i));
  for (const auto& triangle : mesh.triangles) {
    const build::LeafCorners corners{{corner(triangle[0]), corner(triangle[1]), corner(triangle[2]), {}}};
    Box box = format_detail::empty_box();
    for (unsigned k = 0; k < 3; ++k) build::grow(box, corners.v[k]);
    demand.add(build::SplitDemand::of(format_detail::half_area(bounds), box, corners, false));
  }
  const double budget = build::split_budget_for(demand, 1.5, std::numeric_limits<double>::infinity());
  CHECK(budget > 4.0);
  options.split_budget = budget;
  CHECK((in_steps(cables.geometries, options).file == as_needed.file));
}

TEST_CASE("files of many nodes are the same") {
  INFO("seed " << kSeed);
  const auto check = [](Input& input, const gpu::BuildOptions& options) {
    INFO(build::name(options.builder) << ", layout " << static_cast<unsigned>(options.nodes));
    CHECK((at_once(input.geometries, options, enqueue_as_if_large) == at_once(input.geometries, options)));
  };
  Input large({oracle::soup(3000, 0.02, kSeed), oracle::torus(40, 20, 0.3)});
  for (const NodeLayout nodes : kLayouts) check(large, {.builder = Builder::kLbvh, .nodes = nodes});
  check(large, {.builder = Builder::kHploc, .max_leaf_triangles = 8});
  check(large, {.builder = Builder::kSbvh});
  // Trees of about as many nodes as one group writes alone, and of a few times as many.
  for (unsigned count = 20; count < 200; count += 9) {
    INFO(count << " triangles");
    Input input({oracle::soup(count, 0.1, kSeed + count)});
    check(input, {.builder = Builder::kHploc, .pair_triangles = false});
  }
}

TEST_CASE("small and odd scenes in steps") {
  for (const unsigned count : {0u, 1u, 2u, 5u}) {
    Input input({oracle::first_triangles(oracle::soup(std::max(count, 1u), 0.1, kSeed), count)});
    for (const Builder builder : {Builder::kHploc, Builder::kPloc, Builder::kHq})
      check_same(input, {.builder = builder});
  }
  oracle::Mesh flat = oracle::soup(50, 0.1, kSeed), bad = flat;
  for (auto& triangle : flat.triangles) triangle[2] = triangle[1];
  for (std::size_t i = 0; i < bad.triangles.size(); i += 3) bad.triangles[i][0] = 100000;
  Input dropped({flat}), half({bad, flat});
  for (const Builder builder : {Builder::kHploc, Builder::kSbvh}) {
    check_same(dropped, {.builder = builder});
    check_same(half, {.builder = builder});
  }
  const Stepped stepped = in_steps(half.geometries, {});
  CHECK(stepped.report.bad_indices == 17);
  CHECK(stepped.report.status == gpu::BuildStatus::kBadIndex);
  CHECK(stepped.report.dropped_degenerate == 50);
}

TEST_CASE("steps need little memory") {
  // The most that a build may hold at once, in bytes per triangle: the scene, and what makes it.
  struct Limit {
    Builder builder;
    double paired, soup;
  };
  constexpr Limit kLimits[] = {{Builder::kLbvh, 92, 194}, {Builder::kHploc, 92, 194}, {Builder::kPloc, 119, 204},
                               {Builder::kSah, 104, 192}, {Builder::kSbvh, 156, 270}, {Builder::kHq, 276, 508}};
  Input paired({oracle::torus(160, 100, 0.3)}), soup({oracle::soup(20000, 0.02, kSeed)});
  for (const Limit& limit : kLimits)
    for (Input* const input : {&paired, &soup}) {
      const bool is_soup = input == &soup;
      const double triangles = input->geometries[0].primitive_count;
      CountingAllocator allocator;
      const auto scene = must(gpu::build_scene(input->geometries, {.builder = limit.builder}, nullptr, allocator));
      const double most = static_cast<double>(allocator.most) / triangles;
      const double left = static_cast<double>(allocator.balance()) / triangles;
      std::printf("%s, %s: at most %.1f bytes per triangle, %.1f are left\n", build::name(limit.builder),
                  is_soup ? "soup" : "torus", most, left);
      CHECK(allocator.balance() == scene.view.size);
      CHECK(most <= (is_soup ? limit.soup : limit.paired));
    }
}

TEST_CASE("steps out of order are refused") {
  Input input({oracle::soup(20, 0.1, kSeed)});
  CountingAllocator allocator;
  auto steps = must(gpu::BuildSteps::make(input.geometries, {}));
  const gpu::DeviceBuffer none;
  CHECK_THAT(error_of(steps.wait()).message, Contains("no step was started"));
  gpu::DeviceBuffer output[3];
  for (gpu::DeviceBuffer& to : output) {
    CHECK(!steps.done());
    to = dirty(steps.sizes().output + 1, allocator);
    gpu::DeviceBuffer scratch = dirty(steps.sizes().scratch + 1, allocator);
    CHECK_THAT(error_of(steps.enqueue(to.data() + 1, scratch.data(), nullptr)).message, Contains("aligned to 256"));
    CHECK_THAT(error_of(steps.enqueue(to.data(), scratch.data() + 1, nullptr)).message, Contains("aligned to 256"));
    CHECK_THAT(error_of(steps.enqueue(nullptr, scratch.data(), nullptr)).message, Contains("aligned to 256"));
    must(steps.enqueue(to.data(), scratch.data(), nullptr));
    CHECK_THAT(error_of(steps.enqueue(to.data(), scratch.data(), nullptr)).message, Contains("wait() for the step"));
    must(steps.wait());
  }
  REQUIRE(steps.done());
  CHECK_THAT(error_of(steps.enqueue(output[0].data(), output[1].data(), nullptr)).message, Contains("no step is left"));
  CHECK_THAT(error_of(steps.wait()).message, Contains("no step was started"));
  CHECK(steps.report().leaves == 20);
  const Box box{};
  const gpu::DeviceGeometry many{.boxes = &box, .primitive_count = gpu::kMaxBuildPrimitives + 1};
  CHECK_THAT(error_of(gpu::BuildSteps::make({&many, 1}, {})).message, Contains("the limit is 268435454"));
}

TEST_CASE("a step that failed ends the build") {
  Input input({oracle::soup(20, 0.1, kSeed)});
  CountingAllocator allocator;
  bool go_on = true;
  auto steps =
      must(gpu::BuildSteps::make(input.geometries, {.progress = [&](const build::Progress&) { return go_on; }}));
  gpu::DeviceBuffer output = dirty(steps.sizes().output, allocator), scratch = dirty(steps.sizes().scratch, allocator);
  go_on = false;
  CHECK(error_of(steps.enqueue(output.data(), scratch.data(), nullptr)).code == build::ErrorCode::kCancelled);
  go_on = true;
  CHECK_THAT(error_of(steps.enqueue(output.data(), scratch.data(), nullptr)).message, Contains("has failed"));
  CHECK_THAT(error_of(steps.wait()).message, Contains("one has failed"));
}
