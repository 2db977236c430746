// Arrays as programs have them: strides, implicit triangles, given pairs, boxes of two float4, and types of meshes.

#include <hiprt_build/build.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/refit.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/catch.h>

#include <algorithm>
#include <set>

using namespace hiprt;
using build::CustomGeometry;
using build::SceneInput;
using build::TriangleMesh;
using Catch::Matchers::Contains;

namespace {

constexpr std::uint64_t kSeed = 20261126;
constexpr build::Builder kBuilders[] = {build::Builder::kLbvh, build::Builder::kHploc, build::Builder::kSah,
                                        build::Builder::kSbvh, build::Builder::kHq,    oracle::kEmbreeHigh};

/// A vertex as a renderer has it. The numbers beside the position would change a box.
struct Vertex {
  float before[2] = {1e30f, -1e30f};
  build::Position position;
  float behind[4] = {1e30f, 1e30f, -1e30f, std::numeric_limits<float>::quiet_NaN()};
};
struct Face {
  build::Triangle corners;
  std::uint32_t material = 0xffffffffu;
};
struct Float4Box {
  float min[4], max[4];
};

std::vector<Vertex> vertices_of(const oracle::Mesh& mesh) {
  std::vector<Vertex> vertices;
  for (const build::Position& position : mesh.positions) vertices.push_back({.position = position});
  return vertices;
}
std::vector<Face> faces_of(const oracle::Mesh& mesh) {
  std::vector<Face> faces;
  for (const build::Triangle& triangle : mesh.triangles) faces.push_back({triangle});
  return faces;
}

build::Bvh built(const SceneInput& scene, const build::BuildOptions& options = {}) {
  auto bvh = build::build(scene, options);
  INFO((bvh ? "" : bvh.error().message));
  REQUIRE(bvh.has_value());
  const auto valid = validate(bvh->buffer.bytes());
  INFO((valid ? "" : to_string(valid.error())));
  REQUIRE(valid.has_value());
  return std::move(*bvh);
}

bool same_bytes(const build::Bvh& a, const build::Bvh& b) {
  const auto x = a.buffer.bytes(), y = b.buffer.bytes();
  return std::equal(x.begin(), x.end(), y.begin(), y.end());
}

std::string refusal(const SceneInput& scene) {
  const auto bvh = build::build(scene);
  REQUIRE_FALSE(bvh.has_value());
  CHECK(bvh.error().code == build::ErrorCode::kInvalidInput);
  return bvh.error().message;
}
std::string refusal(const TriangleMesh& mesh) { return refusal(SceneInput{.meshes = {&mesh, 1}}); }
std::string refusal(const CustomGeometry& custom) { return refusal(SceneInput{.customs = {&custom, 1}}); }

}  // namespace

TEST_CASE("arrays with gaps make the same file as packed ones") {
  INFO("seed " << kSeed);
  const oracle::Mesh mesh = oracle::soup(700, 0.2, kSeed);
  const std::vector<Vertex> vertices = vertices_of(mesh);
  const std::vector<Face> faces = faces_of(mesh);
  const TriangleMesh packed{.positions = mesh.positions, .triangles = mesh.triangles};
  const TriangleMesh gaps{.positions = {vertices[0].position.data(), vertices.size(), sizeof(Vertex)},
                          .triangles = {faces.data(), faces.size(), sizeof(Face)}};
  for (const build::Builder builder : kBuilders) {
    INFO(build::name(builder));
    CHECK(same_bytes(built({.meshes = {&packed, 1}}, {.builder = builder}),
                     built({.meshes = {&gaps, 1}}, {.builder = builder})));
  }
  // A refit reads the same arrays.
  build::Bvh first = built({.meshes = {&packed, 1}}), second = built({.meshes = {&packed, 1}});
  REQUIRE(build::refit(first.buffer.bytes(), {.meshes = {&packed, 1}}).has_value());
  REQUIRE(build::refit(second.buffer.bytes(), {.meshes = {&gaps, 1}}).has_value());
  CHECK(same_bytes(first, second));
}

TEST_CASE("boxes of two float4 make the same file as packed boxes") {
  oracle::Random random(kSeed);
  std::vector<Box> boxes;
  std::vector<Float4Box> wide;
  for (unsigned i = 0; i < 300; ++i) {
    const oracle::Position p = random.in_cube(10);
    boxes.push_back({{p[0], p[1], p[2]}, {p[0] + 1, p[1] + 2, p[2] + 0.5f}});
    const Box& box = boxes.back();
    wide.push_back({{box.min[0], box.min[1], box.min[2], 1e30f}, {box.max[0], box.max[1], box.max[2], -1e30f}});
  }
  const CustomGeometry packed{.boxes = boxes, .type = 300};
  const CustomGeometry gaps{.boxes = {wide.data(), wide.size(), sizeof(Float4Box), sizeof(float[4])}, .type = 300};
  CHECK(same_bytes(built({.customs = {&packed, 1}}), built({.customs = {&gaps, 1}})));
}

TEST_CASE("implicit triangles are those of three positions each") {
  INFO("seed " << kSeed);
  const oracle::Mesh mesh = oracle::soup(500, 0.2, kSeed);
  std::vector<build::Position> corners;
  std::vector<build::Triangle> triangles;
  for (const build::Triangle& triangle : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(corners.size());
    triangles.push_back({first, first + 1, first + 2});
    for (const std::uint32_t index : triangle) corners.push_back(mesh.positions[index]);
  }
  const TriangleMesh indexed{.positions = corners, .triangles = triangles};
  const TriangleMesh implicit{.positions = corners, .implicit_triangles = true};
  const auto without_provenance = [](const build::Bvh& bvh) {
    const auto view = open_buffer(bvh.buffer.bytes());
    const auto leaves = bvh.buffer.bytes().subspan(view->leaves.offset, view->leaves.count * sizeof(PlanesLeaf));
    return std::vector<std::byte>(leaves.begin(), leaves.end());
  };
  for (const build::Builder builder : kBuilders)
    CHECK(without_provenance(built({.meshes = {&indexed, 1}}, {.builder = builder})) ==
          without_provenance(built({.meshes = {&implicit, 1}}, {.builder = builder})));
  CHECK(built({.meshes = {&implicit, 1}}).statistics.triangles == 500);
}

TEST_CASE("given pairs become leaves") {
  // A strip of four quads: triangles 2 i and 2 i + 1 share a diagonal, 2 i + 1 and 2 i + 2 an edge.
  std::vector<build::Position> positions;
  std::vector<build::Triangle> triangles;
  for (unsigned i = 0; i < 5; ++i)
    for (unsigned k = 0; k < 2; ++k) positions.push_back({static_cast<float>(i), static_cast<float>(k), 0});
  for (std::uint32_t i = 0; i < 4; ++i) {
    triangles.push_back({2 * i, 2 * i + 2, 2 * i + 1});
    triangles.push_back({2 * i + 1, 2 * i + 2, 2 * i + 3});
  }
  const build::TrianglePair pairs[] = {{2, 1}, {3, 4}, {0, 7}, {5, 5}};
  const TriangleMesh mesh{.positions = positions, .triangles = triangles, .pairs = pairs};
  for (const build::Builder builder : {build::Builder::kLbvh, build::Builder::kHploc, build::Builder::kSah}) {
    const build::Bvh bvh = built({.meshes = {&mesh, 1}}, {.builder = builder});
    CHECK(bvh.statistics.pairs == 2);
    const auto view = open_buffer(bvh.buffer.bytes());
    std::set<std::pair<std::uint32_t, std::uint32_t>> leaves;
    for (const PlanesLeaf& leaf : view->records<PlanesLeaf>(view->leaves))
      leaves.insert({leaf.info.primitive[0], leaf.info.primitive[1]});
    // 0 and 7 have no common edge.
    CHECK(leaves == std::set<std::pair<std::uint32_t, std::uint32_t>>{
                        {1, 2}, {3, 4}, {0, kInvalidId}, {7, kInvalidId}, {5, kInvalidId}, {6, kInvalidId}});
  }
  CHECK(built({.meshes = {&mesh, 1}}, {.pair_triangles = false}).statistics.pairs == 0);
  const build::TrianglePair twice[] = {{2, 1}, {1, 0}}, beyond[] = {{2, 8}};
  CHECK_THAT(refusal(TriangleMesh{.positions = positions, .triangles = triangles, .pairs = twice}),
             Contains("mesh 0, pair 1: triangle 1 is in an earlier pair, too"));
  CHECK_THAT(refusal(TriangleMesh{.positions = positions, .triangles = triangles, .pairs = beyond}),
             Contains("mesh 0, pair 0: triangle 8, but there are 8"));
}

TEST_CASE("types of meshes are in the file") {
  const oracle::Mesh mesh = oracle::soup(3, 0.2, kSeed);
  const TriangleMesh meshes[] = {{.positions = mesh.positions, .triangles = mesh.triangles},
                                 {.positions = mesh.positions, .triangles = mesh.triangles, .type = kMaxGeometryType}};
  build::Bvh bvh = built({.meshes = meshes});
  const auto view = open_buffer(bvh.buffer.bytes());
  CHECK(geometry_type(view->geometries[0].flags) == 0);
  CHECK(geometry_type(view->geometries[1].flags) == kMaxGeometryType);
  CHECK((view->geometries[1].flags & kGeometryCustom) == 0);
  const TriangleMesh other[] = {meshes[0], meshes[0]};
  const auto moved = build::refit(bvh.buffer.bytes(), {.meshes = other});
  REQUIRE_FALSE(moved.has_value());
  CHECK_THAT(moved.error().message, Contains("mesh 1: type 0, but in the file to refit type 16777215"));
}

TEST_CASE("arrays that cannot be are refused, with what to do") {
  const oracle::Mesh mesh = oracle::soup(4, 0.2, kSeed);
  const auto with = [&](auto change) {
    TriangleMesh view{.positions = mesh.positions, .triangles = mesh.triangles, .name = "chair"};
    change(view);
    return refusal(view);
  };
  CHECK(with([](TriangleMesh& m) { m.triangles = {}; }) ==
        "mesh 0 (chair): 12 positions but no triangles; give triangles, or set implicit_triangles");
  CHECK_THAT(with([](TriangleMesh& m) { m.implicit_triangles = true; }), Contains("leave triangles empty"));
  CHECK_THAT(with([&](TriangleMesh& m) {
               m.triangles = {};
               m.positions = std::span(mesh.positions).first(10);
               m.implicit_triangles = true;
             }),
             Contains("10 positions, but implicit triangles need a multiple of 3"));
  for (const std::size_t stride : {std::size_t{0}, std::size_t{8}, std::size_t{13}, std::size_t{1} << 32})
    CHECK_THAT(with([&](TriangleMesh& m) {
                 m.positions = {mesh.positions.data(), 3, stride};
               }),
               Contains("positions: a stride of " + std::to_string(stride) + " bytes"));
  CHECK_THAT(with([&](TriangleMesh& m) {
               m.triangles = {mesh.triangles.data(), 2, 10};
             }),
             Contains("triangles: a stride of 10 bytes"));
  CHECK_THAT(with([](TriangleMesh& m) { m.triangles = {nullptr, 2, 12}; }), Contains("at the null pointer"));
  CHECK_THAT(with([&](TriangleMesh& m) {
               m.positions = {reinterpret_cast<const std::byte*>(mesh.positions.data()) + 2, 2, 12};
             }),
             Contains("not aligned to 4 bytes"));
  CHECK_THAT(with([](TriangleMesh& m) { m.type = kMaxGeometryType + 1; }), Contains("type 16777216, the limit is"));
  const Box boxes[2] = {};
  CHECK_THAT(refusal(CustomGeometry{.boxes = {boxes, 2, 24, 16}}), Contains("the upper corner is at byte 16"));
  CHECK_THAT(refusal(CustomGeometry{.boxes = {boxes, 2, 20}}), Contains("a stride of 20 bytes"));
  CHECK_THAT(refusal(CustomGeometry{.boxes = boxes, .type = kMaxGeometryType + 1}), Contains("the limit is"));
}
