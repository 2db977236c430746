// Invalid refits: the error names the triangle or primitive, and the file stays as it was.

#include <hiprt_build/instances.h>
#include <tests/build/refit_file.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/motions.h>
#include <tests/oracle/random.h>

#include <bit>

using namespace hiprt;
using namespace hiprt::oracle;
using namespace hiprt::test;
using build::ErrorCode;
using build::SceneInput;
using Catch::Contains;

TEST_CASE("invalid refits are refused with mesh and triangle, and the file stays unchanged") {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const Mesh mesh = icosphere(3);
  Mesh with_dropped = mesh;
  append(with_dropped, {0, 0, 0}, {0, 0, 0}, {1, 0, 0});
  append(with_dropped, {0, 0, 0}, {kNan, 0, 0}, {1, 0, 0});
  for (const NodeLayout layout : kLayouts) {
    CAPTURE(static_cast<std::uint32_t>(layout));
    File file = built(with_dropped, {.nodes = layout});
    const auto message = [&](const Mesh& moved) {
      const build::Error error = refusal(file, moved);
      CHECK(error.code == ErrorCode::kInvalidInput);
      return error.message;
    };
    Mesh bad = with_dropped;
    bad.triangles.pop_back();
    CHECK_THAT(message(bad), Contains("mesh 0: 1281 triangles") && Contains("has 1282"));
    bad = with_dropped;
    bad.triangles[1100][2] = 1u << 30;
    bad.triangles[70][1] = static_cast<std::uint32_t>(bad.positions.size());
    CHECK_THAT(message(bad), Contains("mesh 0, triangle 70: index 648") && Contains("648 vertices"));
    bad = with_dropped;
    bad.positions[bad.triangles[5][1]][2] = std::numeric_limits<float>::infinity();
    CHECK_THAT(message(bad), Contains(", triangle ") && Contains("is in the tree, but is not finite now"));
    bad = with_dropped;
    bad.positions[bad.triangles[1280][1]] = {0, 1, 0};
    CHECK_THAT(message(bad), Contains("triangle 1280: was dropped") && Contains("needs a new build"));
    bad = with_dropped;
    bad.positions[bad.triangles[1281][1]] = {0, 1, 0};
    CHECK_THAT(message(bad), Contains("triangle 1281: was dropped"));
    refitted(file, with_dropped);
  }
}

TEST_CASE("every vertex and axis: NaN and infinity are refused with the triangle, and the file stays unchanged") {
  const Mesh mesh = icosphere(2);
  Random random(kSeed);
  INFO("seed " << kSeed);
  const float quiet = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  // Some NaN compare as others do when they are taken for integers: signs and payloads matter.
  const float bad[] = {quiet,    -quiet,   std::bit_cast<float>(0x7f800001u), std::bit_cast<float>(0xffbfffffu),
                       infinity, -infinity};
  for (const NodeLayout layout : kLayouts) {
    CAPTURE(static_cast<std::uint32_t>(layout));
    File paired = built(mesh, {.nodes = layout}), single = built(mesh, {.nodes = layout, .pair_triangles = false});
    for (const float value : bad)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Mesh moved = twisted(mesh, 0.1);
        const std::uint32_t vertex = random.below(static_cast<std::uint32_t>(mesh.positions.size()));
        moved.positions[vertex][axis] = value;
        INFO("vertex " << vertex << ", axis " << axis << ", " << value);
        for (File* file : {&paired, &single}) {
          const build::Error error = refusal(*file, moved);
          CHECK(error.code == ErrorCode::kInvalidInput);
          REQUIRE_THAT(error.message,
                       Contains("mesh 0, triangle ") && Contains("is in the tree, but is not finite now"));
          // The triangle that is named has the vertex.
          const std::size_t number = std::stoul(error.message.substr(std::string("mesh 0, triangle ").size()));
          REQUIRE(number < mesh.triangles.size());
          const build::Triangle& named = mesh.triangles[number];
          CHECK((named[0] == vertex || named[1] == vertex || named[2] == vertex));
        }
      }
    // Vertices that no triangle of the tree uses may have any value.
    Mesh moved = twisted(mesh, 0.1);
    moved.positions.push_back({quiet, infinity, -infinity});
    refitted(paired, moved);
    check_moved(paired, moved);
  }
}

TEST_CASE("boxes of custom primitives: NaN and infinity are refused with the primitive, and the file stays unchanged") {
  const float quiet = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  Random random(kSeed);
  INFO("seed " << kSeed);
  std::vector<Box> boxes;
  for (unsigned i = 0; i < 60; ++i) {
    const Position p = random.in_cube(1);
    boxes.push_back({{p[0], p[1], p[2]}, {p[0] + 0.1f, p[1] + 0.2f, p[2] + 0.3f}});
  }
  for (const NodeLayout layout : kLayouts) {
    CAPTURE(static_cast<std::uint32_t>(layout));
    const build::CustomGeometry geometry[1] = {{.boxes = boxes}};
    File file = built(SceneInput{{}, geometry}, {.nodes = layout});
    for (const float value : {quiet, -quiet, infinity, -infinity})
      for (unsigned side = 0; side < 6; ++side) {
        std::vector<Box> moved = boxes;
        const std::size_t number = random.below(60);
        (side < 3 ? moved[number].min : moved[number].max)[side % 3] = value;
        INFO("box " << number << ", side " << side << ", " << value);
        const build::CustomGeometry changed[1] = {{.boxes = moved}};
        const build::Error error = refusal(file, SceneInput{{}, changed});
        CHECK(error.code == ErrorCode::kInvalidInput);
        CHECK_THAT(error.message,
                   Contains(" " + std::to_string(number) + ": is in the tree, but its box is not finite now"));
      }
  }
}

TEST_CASE("a scene of instances is not refitted") {
  const build::Buffer object = std::move(built(icosphere(1), {}).bvh.buffer);
  const std::vector<std::span<const std::byte>> files{object.bytes()};
  const std::vector<build::Instance> instances(3);
  auto scene = build::build_instances(files, instances);
  REQUIRE(scene.has_value());
  const std::vector<Box> boxes(3, Box{{0, 0, 0}, {1, 1, 1}});
  const build::CustomGeometry moved[1] = {{.boxes = boxes}};
  const auto refused = build::refit(scene->buffer.bytes(), SceneInput{{}, moved});
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == ErrorCode::kInvalidInput);
  CHECK_THAT(refused.error().message, Contains("a scene of instances cannot be refitted"));
}

TEST_CASE("pairs whose common edge separates are refused; without pairs every vertex may move") {
  const Mesh mesh = unshared(icosphere(3)), moved = exploded(mesh, 0.5, kSeed);
  for (const NodeLayout layout : kLayouts) {
    CAPTURE(static_cast<std::uint32_t>(layout));
    File paired = built(mesh, {.nodes = layout}), single = built(mesh, {.nodes = layout, .pair_triangles = false});
    REQUIRE(paired.bvh.statistics.pairs > 500);
    CHECK_THAT(refusal(paired, moved).message, Contains("triangle ") && Contains("has come apart"));
    const Mesh together = twisted(mesh, 0.25);
    refitted(paired, together);
    check_moved(paired, together);
    refitted(single, moved);
    check_moved(single, moved);
  }
}

TEST_CASE("data that is not a file, and options out of range, are refused") {
  File file = built(icosphere(1));
  const Mesh mesh = icosphere(1);
  const std::vector meshes{mesh.view()};
  const SceneInput scene{meshes, {}};
  for (const double ratio : {0.0, 0.99, -1.0, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THAT(refusal(file, scene, {.rebuild_ratio = ratio}).message,
               Contains("rebuild_ratio is") && Contains("at least 1"));
  for (const double slack : {-0.01, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THAT(refusal(file, scene, {.rebuild_slack = slack}).message,
               Contains("rebuild_slack is") && Contains("at least 0"));
  refitted(file, scene, {.threads = 1000, .rebuild_ratio = std::numeric_limits<double>::infinity()});
  const auto error_of = [&](std::span<std::byte> bytes) {
    const auto result = build::refit(bytes, scene);
    REQUIRE_FALSE(result.has_value());
    CHECK(result.error().code == ErrorCode::kInvalidInput);
    const auto copied = build::refit_copy(bytes, scene);
    REQUIRE_FALSE(copied.has_value());
    return result.error().message;
  };
  CHECK_THAT(error_of({}), Contains("not a BVH file"));
  CHECK_THAT(error_of(file.bytes().first(file.bytes().size() - 1)), Contains("SizeMismatch"));
  CHECK(build::refit(file.bytes().subspan(1), scene).error().message.find("Misaligned") != std::string::npos);
  file.bytes()[0] = std::byte{0};
  CHECK_THAT(error_of(file.bytes()), Contains("BadMagic"));
}
