// Invalid input of builders and the error messages.

#include <hiprt_build/build.h>
#include <hiprt_build/encode/encode.h>
#include <hiprt_build/instances.h>
#include <hiprt_build/shapes.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/meshes.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::oracle;
using build::BuildOptions;
using build::ErrorCode;
using Catch::Contains;

namespace {

build::Error refusal(const std::vector<build::TriangleMesh>& meshes, const BuildOptions& options = {}) {
  const auto result = build::build(meshes, options);
  REQUIRE_FALSE(result.has_value());
  CHECK(result.error().message.find('\n') == std::string::npos);
  return result.error();
}

}  // namespace

TEST_CASE("an index past the vertices is refused with the first mesh and triangle that has one") {
  const Mesh good = icosphere(1);
  Mesh bad = icosphere(4);
  bad.triangles[4000][1] = 1u << 31;
  bad.triangles[77][2] = static_cast<std::uint32_t>(bad.positions.size());
  build::TriangleMesh named = bad.view();
  named.name = "ball.obj";
  for (const unsigned threads : {1u, 4u}) {
    const build::Error error = refusal({good.view(), named}, {.threads = threads});
    CHECK(error.code == ErrorCode::kInvalidInput);
    CHECK_THAT(error.message, Contains("mesh 1 (ball.obj), triangle 77") && Contains("index 2562") &&
                                  Contains("there are 2562 vertices"));
  }
}

TEST_CASE("options out of range are refused with the limits") {
  const Mesh mesh = icosphere(1);
  for (const unsigned triangles : {0u, 65u, ~0u}) {
    const build::Error error = refusal({mesh.view()}, {.max_leaf_triangles = triangles});
    CHECK(error.code == ErrorCode::kInvalidInput);
    CHECK_THAT(error.message, Contains("is " + std::to_string(triangles)) && Contains("1 to 64"));
  }
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (const build::SahCosts& costs : {build::SahCosts{0, 1}, build::SahCosts{1, 0}, build::SahCosts{-1, 1},
                                       build::SahCosts{1, kNan}, build::SahCosts{1, 1, 0}, build::SahCosts{1, 1, kNan}})
    CHECK_THAT(refusal({mesh.view()}, {.costs = costs}).message, Contains("positive"));
  for (const double budget : {-1.0, 0.99, 16.5, static_cast<double>(kNan)}) {
    CHECK_THAT(refusal({mesh.view()}, {.split_budget = budget}).message,
               Catch::StartsWith("split_budget") && Contains("1 to 16"));
    CHECK_THAT(refusal({mesh.view()}, {.presplit_budget = budget}).message,
               Catch::StartsWith("presplit_budget") && Contains("1 to 16"));
  }
  for (const unsigned radius : {0u, 129u, ~0u})
    CHECK_THAT(refusal({mesh.view()}, {.ploc_radius = radius}).message,
               Contains("ploc_radius") && Contains("1 to 128"));
  CHECK_THAT(refusal({mesh.view()}, {.reinsertion_rounds = 1001}).message,
             Contains("reinsertion_rounds is 1001") && Contains("0 to 1000"));
  for (const std::uint32_t layout : {0u, 5u, 99u})
    CHECK_THAT(refusal({mesh.view()}, {.nodes = static_cast<NodeLayout>(layout)}).message,
               Contains("layout " + std::to_string(layout)));
}

TEST_CASE("a library without Embree has no version of it and refuses its builders") {
  CHECK((build::embree_version()[0] != '\0') == kHasEmbree);
  const Mesh mesh = icosphere(1);
  for (const auto builder : {build::Builder::kEmbreeLow, build::Builder::kEmbreeMedium, build::Builder::kEmbreeHigh}) {
    const auto bvh = build::build(std::vector{mesh.view()}, {.builder = builder});
    CHECK(bvh.has_value() == kHasEmbree);
    if (bvh) continue;
    CHECK(bvh.error().code == ErrorCode::kInvalidInput);
    CHECK(bvh.error().message ==
          std::string("builder ") + name(builder) + " needs Embree, which this library was built without");
  }
}

TEST_CASE("values without an enumerator are refused") {
  const Mesh mesh = icosphere(1);
  for (const int builder : {-1, 11, 99}) {
    const build::Error error = refusal({mesh.view()}, {.builder = static_cast<build::Builder>(builder)});
    CHECK(error.code == ErrorCode::kInvalidInput);
    CHECK_THAT(error.message, Contains("builder is " + std::to_string(builder)) && Contains("build::Builder"));
  }
  for (const int quality : {-1, 3, 9}) {
    const build::Error error = refusal({mesh.view()}, build::options_for(static_cast<build::Quality>(quality)));
    CHECK(error.code == ErrorCode::kInvalidInput);
    CHECK_THAT(error.message, Contains("build::Builder"));
  }
  const auto built = build::build(std::vector{mesh.view()});
  REQUIRE(built.has_value());
  const std::span<const std::byte> files[] = {built->buffer.bytes()};
  const build::Instance instances[1] = {};
  for (const unsigned bounds : {4u, 9u}) {
    const auto scene = build::build_instances(files, instances, {.bounds = static_cast<build::InstanceBounds>(bounds)});
    REQUIRE_FALSE(scene.has_value());
    CHECK(scene.error().code == ErrorCode::kInvalidInput);
    CHECK_THAT(scene.error().message, Contains("bounds is " + std::to_string(bounds)) && Contains("InstanceBounds"));
  }
  const ShapePoint point{{0, 0, 0}, 1};
  const auto boxes = build::shape_boxes({.kind = static_cast<ShapeKind>(9), .points = {&point, 1}});
  REQUIRE_FALSE(boxes.has_value());
  CHECK(boxes.error().code == ErrorCode::kInvalidInput);
  CHECK_THAT(boxes.error().message, Contains("kind 9"));
}

TEST_CASE("coordinates that a quantized node cannot hold are refused with the triangle and the alternatives") {
  const Mesh good = icosphere(1);
  Mesh bad = icosphere(4);
  const std::uint32_t vertex = bad.triangles[100][1];
  bad.positions[vertex][2] = -0x1p126f;
  build::TriangleMesh named = bad.view();
  named.name = "ball.obj";
  const auto first = std::find_if(bad.triangles.begin(), bad.triangles.end(),
                                  [&](const Triangle& t) { return std::find(t.begin(), t.end(), vertex) != t.end(); });
  for (const bool pairs : {false, true}) {
    const build::Error error =
        refusal({good.view(), named}, {.nodes = NodeLayout::kQuantized, .pair_triangles = pairs});
    CHECK(error.code == ErrorCode::kInvalidInput);
    CHECK_THAT(error.message,
               Contains("mesh 1 (ball.obj), triangle ") && Contains("2^126") && Contains("float, planes and half"));
    if (!pairs) CHECK_THAT(error.message, Contains("triangle " + std::to_string(first - bad.triangles.begin()) + ":"));
  }
  for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf})
    CHECK(build::build(std::vector{good.view(), named}, {.nodes = layout}).has_value());
  bad.positions[vertex][2] = std::nextafter(-0x1p126f, 0.0f);
  CHECK(build::build(std::vector{bad.view()}, {.nodes = NodeLayout::kQuantized}).has_value());
  // Triangles that are dropped do not matter.
  bad.positions[vertex][2] = -std::numeric_limits<float>::infinity();
  CHECK(build::build(std::vector{bad.view()}, {.nodes = NodeLayout::kQuantized}).has_value());
}

TEST_CASE("sizes that ids and references cannot number are refused with the number") {
  // Refused by their sizes alone: the memory behind these spans is never looked at.
  const build::Position position{};
  const build::Triangle triangle{};
  const auto mesh = [&](std::size_t vertices, std::size_t triangles) {
    return build::TriangleMesh{{&position, vertices}, {&triangle, triangles}};
  };
  for (const build::Error& error :
       {refusal({mesh(3, std::size_t{1} << 30)}), refusal({mesh(3, 0), mesh(std::size_t{1} << 31, 0)}),
        refusal({mesh(3, (1u << 30) - 1), mesh(3, (1u << 30) - 1), mesh(3, 2)})})
    CHECK(error.code == ErrorCode::kTooLarge);
  CHECK_THAT(refusal({mesh(3, std::size_t{1} << 30)}).message,
             Contains("mesh 0 has 1073741824 triangles, the limit is 1073741823"));
  CHECK_THAT(refusal({mesh(3, 0), mesh(std::size_t{1} << 31, 0)}).message, Contains("mesh 1 has 2147483648 vertices"));
  CHECK_THAT(refusal({mesh(3, (1u << 30) - 1), mesh(3, (1u << 30) - 1), mesh(3, 2)}).message,
             Contains("2147483648 triangles, the limit is 2147483647"));
}

TEST_CASE("more nodes and leaves than a 32-bit reference addresses are refused with their number") {
  // Header and section table take 384 bytes: three nodes.
  const std::uint64_t nodes = (std::uint64_t{1} << 28) - 4;
  CHECK(build::check_addresses(NodeLayout::kFloat, nodes, 0).has_value());
  CHECK(build::check_addresses(NodeLayout::kFloat, nodes - 1, 1).has_value());
  CHECK(build::check_addresses(NodeLayout::kFloat, nodes - 2, 3).has_value());
  // Nodes of 64 bytes: twice as many less one, as the leaves start at a multiple of 128.
  CHECK(build::check_addresses(NodeLayout::kHalf, 2 * nodes, 1).has_value());
  CHECK(build::check_addresses(NodeLayout::kQuantized, 2 * nodes - 1, 1).has_value());
  CHECK_FALSE(build::check_addresses(NodeLayout::kQuantized, 2 * nodes + 1, 1).has_value());
  // 64 nodes of planes and the gap behind them: 129 times 64 bytes.
  const std::uint64_t blocks = 2 * nodes / 129;
  CHECK(build::check_addresses(NodeLayout::kPlanes, 64 * blocks, 0).has_value());
  CHECK_FALSE(build::check_addresses(NodeLayout::kPlanes, 64 * (blocks + 1), 0).has_value());
  const auto refused = build::check_addresses(NodeLayout::kPlanes, nodes, 3);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == ErrorCode::kTooLarge);
  CHECK_THAT(refused.error().message, Contains("268435452 nodes and 3 leaves") && Contains("34359738304"));
}
