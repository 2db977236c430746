// Builds of spheres, curves and moving triangles: content of the file, error messages, refits.

#include <hiprt_build/exchange.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/instances.h>
#include <hiprt_build/refit.h>
#include <hiprt_build/shapes.h>
#include <hiprt_device/instances/motion.h>
#include <tests/oracle/random.h>

#include <tests/catch.h>

#include <bit>
#include <limits>
#include <utility>

using namespace hiprt;
using build::Shapes;
using Catch::Contains;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
const std::vector<std::uint32_t> kOfStrands{3, 1, 2};

struct Wig {
  std::vector<ShapePoint> points{{{0, 0, 0}, 0.5f}, {{1, 0, 0}, 0.25f}, {{2, 0, 0}, 0},
                                 {{9, 9, 9}, 1},    {{0, 4, 0}, 0.5f},  {{0, 4, 0}, 0.25f}};
  std::vector<std::uint32_t> segments = build::strand_segments(kOfStrands);

  Shapes shapes() const { return {ShapeKind::kCurves, points, segments}; }
};

/// A square of two triangles that rises and leans.
struct Flap {
  std::vector<ShapePoint> points{{{0, 0, 0}, -2}, {{1, 0, 0}, -2}, {{1, 1, 0}, -2}, {{0, 1, 0}, -2},
                                 {{0, 0, 2}, 1},  {{1, 0, 2}, 1},  {{1, 1, 2}, 1},  {{0, 1, 2}, 1},
                                 {{0, 0, 2}, 3},  {{1, 0, 2}, 3},  {{1, 4, 2}, 3},  {{0, 1, 2}, 3}};
  std::vector<std::uint32_t> corners{0, 1, 2, 0, 2, 3};
  std::uint32_t keys = 3;

  Shapes shapes() const { return {ShapeKind::kMovingTriangles, points, corners, keys}; }
};

std::vector<Box> boxes_of(const Shapes& shapes) {
  auto boxes = build::shape_boxes(shapes);
  INFO((boxes ? "" : boxes.error().message));
  REQUIRE(boxes.has_value());
  return std::move(*boxes);
}

std::string fault(const Shapes& shapes) {
  const auto boxes = build::shape_boxes(shapes);
  REQUIRE_FALSE(boxes.has_value());
  return boxes.error().message;
}

std::string build_fault(const build::CustomGeometry& custom) {
  const auto bvh = build::build(build::SceneInput{{}, {&custom, 1}});
  REQUIRE_FALSE(bvh.has_value());
  CHECK(bvh.error().code == build::ErrorCode::kInvalidInput);
  return bvh.error().message;
}

build::Bvh built(const build::CustomGeometry& custom, const build::BuildOptions& options = {}) {
  auto bvh = build::build(build::SceneInput{{}, {&custom, 1}}, options);
  INFO((bvh ? "" : bvh.error().message));
  REQUIRE(bvh.has_value());
  const auto valid = validate(bvh->buffer.bytes());
  INFO((valid ? "" : to_string(valid.error())));
  REQUIRE(valid.has_value());
  return std::move(*bvh);
}

}  // namespace

TEST_CASE("segments of strands: every point except a strand's last one begins a segment") {
  CHECK(build::strand_segments(kOfStrands) == std::vector<std::uint32_t>{0, 1, 4});
  CHECK(build::strand_segments({}).empty());
  const std::vector<std::uint32_t> odd{0, 1, 2};
  CHECK(build::strand_segments(odd) == std::vector<std::uint32_t>{1});
}

TEST_CASE("boxes of shapes are the smallest; shapes of size 0 have inverted boxes") {
  const auto boxes = boxes_of(Wig{}.shapes());
  REQUIRE(boxes.size() == 3);
  CHECK(boxes[0].min[0] == -0.5f);
  CHECK(boxes[0].max[0] == 1.25f);
  CHECK(boxes[1].max[0] == 2);
  CHECK(boxes[2].max[1] == 4.5f);
  // 0.1f + 1e-9f is not a float: the side is rounded outwards.
  const ShapePoint points[] = {{{0.1f, 0, 0}, 1e-9f}, {{0, 0, 0}, 0}};
  const auto spheres = boxes_of({ShapeKind::kSpheres, points, {}});
  CHECK(spheres[0].max[0] == std::nextafter(0.1f, 1.0f));
  CHECK(spheres[0].min[0] == std::nextafter(0.1f, 0.0f));
  CHECK(spheres[1].min[0] > spheres[1].max[0]);
}

TEST_CASE("invalid shapes are refused with their number") {
  Wig wig;
  wig.points[3].radius = -1;
  CHECK(fault(wig.shapes()) == "point 3: radius -1, at least 0 expected");
  wig.points[1].position[2] = kNan;
  CHECK(fault(wig.shapes()) == "point 1: z is nan");
  wig = {};
  wig.points[5].radius = kInfinity;
  CHECK(fault(wig.shapes()) == "point 5: radius inf, a finite number expected");
  wig = {};
  wig.segments[1] = 5;
  CHECK(fault(wig.shapes()) == "segment 1: points 5 and 6, but there are 6");
  wig.segments[1] = 0xffffffffu;
  CHECK_THAT(fault(wig.shapes()), Contains("segment 1: points 4294967295 and 4294967296"));
  wig = {};
  Shapes shapes = wig.shapes();
  shapes.kind = ShapeKind::kSpheres;
  CHECK(fault(shapes) == "3 segments of shapes that are no curves");
}

TEST_CASE("moving triangles: boxes hold all keys, and bad ones are refused with their number") {
  Flap flap;
  const auto boxes = boxes_of(flap.shapes());
  REQUIRE(boxes.size() == 2);
  CHECK(boxes[0].max[1] >= 4);
  CHECK(boxes[0].max[1] < 4.00001f);
  CHECK(boxes[1].max[1] >= 4);
  CHECK(boxes[0].min[2] <= 0);
  CHECK(boxes[1].max[2] >= 2);
  flap.keys = 1;
  CHECK(fault(flap.shapes()) == "1 keys of moving triangles, 2 or more expected");
  flap.keys = 5;
  CHECK(fault(flap.shapes()) == "5 keys, but 12 points: each key needs all vertices");
  flap.keys = 3;
  flap.corners[4] = 4;
  CHECK(fault(flap.shapes()) == "triangle 1: vertex 4, but there are 4");
  flap.corners.pop_back();
  CHECK(fault(flap.shapes()) == "5 vertex numbers, a multiple of 3 expected");
  flap = {};
  flap.points[7].position[1] = kNan;
  CHECK(fault(flap.shapes()) == "point 7: y is nan");
  flap = {};
  flap.points[5].radius = 2;
  CHECK(fault(flap.shapes()) == "point 5: time 2, that of its key is 1");
  flap = {};
  for (std::size_t i = 8; i < 12; ++i) flap.points[i].radius = 1;
  CHECK(fault(flap.shapes()) == "point 8: time 1, later than 1 expected");
  flap.points[9].radius = -kInfinity;
  CHECK(fault(flap.shapes()) == "point 9: time -inf, a finite number expected");
  Shapes curves = Wig{}.shapes();
  curves.keys = 2;
  CHECK(fault(curves) == "2 keys of shapes that do not move");
  // Points without a kind have no keys: their boxes are those of spheres.
  const ShapePoint point[] = {{{0, 0, 0}, 1}};
  CHECK(boxes_of({ShapeKind::kNone, point, {}})[0].max[0] == 1);
}

TEST_CASE("boxes of moving triangles are wider by 2^-22 of each coordinate, more than interpolation rounds") {
  Flap flap;
  const Box box = boxes_of(flap.shapes())[0];
  CHECK(box.max[1] == 4 + 4 * 0x1p-22f);
  CHECK(box.min[0] == -0x1p-148f);
  for (ShapePoint& point : flap.points) point.position[2] -= 4;
  CHECK(boxes_of(flap.shapes())[0].min[2] == -4 - 4 * 0x1p-22f);
  // 1 - s, the product and the sum: three roundings of 2^-24.
  oracle::Random random(20261129);
  float most = 0;
  for (unsigned i = 0; i < 100000; ++i) {
    const float at = random.uniform_float(1, 2), s = static_cast<float>(random.unit());
    most = std::max(most, std::abs(motion_detail::between(at, at, 1.0f - s, s) - at) / at);
  }
  INFO("seed 20261129: " << most / 0x1p-24f << " units");
  CHECK(most > 0x1p-24f);
  CHECK(most <= 3 * 0x1p-24f);
}

TEST_CASE("files hold moving triangles, and refits move them") {
  Flap flap;
  auto boxes = boxes_of(flap.shapes());
  const build::Bvh bvh = built({.boxes = boxes, .type = 3, .shapes = flap.shapes()});
  const BufferView view = *open_buffer(bvh.buffer.bytes());
  CHECK(view.shapes[0].keys == 3);
  CHECK(view.points_of(0).size() == 12);
  const auto corners = view.segments_of(0);
  CHECK(std::vector(corners.begin(), corners.end()) == flap.corners);
  const auto refitted = [&](const Flap& moved) {
    const auto moved_boxes = build::shape_boxes(moved.shapes());
    REQUIRE(moved_boxes.has_value());
    const build::CustomGeometry custom{.boxes = *moved_boxes, .type = 3, .shapes = moved.shapes()};
    return build::refit_copy(bvh.buffer.bytes(), build::SceneInput{{}, {&custom, 1}});
  };
  flap.points[10].position[1] = 7;
  const auto moved = refitted(flap);
  REQUIRE(moved.has_value());
  CHECK(validate(moved->buffer.bytes()).has_value());
  CHECK(open_buffer(moved->buffer.bytes())->header->bounds.max[1] >= 7);
  Flap other = flap;
  other.corners[3] = 1;
  CHECK_THAT(refitted(other).error().message, Contains("triangle 1 has vertex 1, but in the file to refit 0"));
  other = flap;
  other.keys = 2;
  for (std::size_t i = 0; i < 12; ++i) other.points[i].radius = i < 6 ? 0 : 1;
  CHECK_THAT(refitted(other).error().message, Contains("2 keys, but the file to refit has 3"));
}

TEST_CASE("builds refuse shapes that do not match their boxes") {
  const Wig wig;
  auto boxes = boxes_of(wig.shapes());
  build::CustomGeometry custom{.boxes = boxes, .name = "wig", .shapes = wig.shapes()};
  custom.boxes = std::span(boxes).first(2);
  CHECK(build_fault(custom) == "custom geometry 0 (wig): 3 shapes, but 2 boxes");
  custom.boxes = boxes;
  boxes[1].max[0] = 1.5f;
  CHECK(build_fault(custom) == "custom geometry 0 (wig), primitive 1: its shape is not inside its box");
  custom.shapes.kind = ShapeKind{4};
  CHECK(build_fault(custom) == "custom geometry 0 (wig): shapes of kind 4");
  custom.shapes.kind = ShapeKind::kNone;
  CHECK(build_fault(custom) == "custom geometry 0 (wig): shapes of kind 0");
}

TEST_CASE("files hold shapes, and the same ones for every builder and number of threads") {
  const Wig wig;
  const auto boxes = boxes_of(wig.shapes());
  const build::CustomGeometry custom{.boxes = boxes, .type = 9, .shapes = wig.shapes()};
  for (const auto builder : {build::Builder::kSah, build::Builder::kLbvh, build::Builder::kPloc}) {
    const build::Bvh bvh = built(custom, {.builder = builder, .threads = 1});
    const BufferView view = *open_buffer(bvh.buffer.bytes());
    CHECK(view.header->version_minor == kVersionMinor);
    REQUIRE(view.points_of(0).size() == wig.points.size());
    for (std::size_t i = 0; i < wig.points.size(); ++i) {
      using Words = std::array<std::uint32_t, 4>;
      CHECK(std::bit_cast<Words>(view.points_of(0)[i]) == std::bit_cast<Words>(wig.points[i]));
    }
    const auto segments = view.segments_of(0);
    CHECK(std::vector(segments.begin(), segments.end()) == wig.segments);
    CHECK(geometry_type(view.geometries[0].flags) == 9);
    const build::Bvh again = built(custom, {.builder = builder});
    CHECK(std::equal(again.buffer.bytes().begin(), again.buffer.bytes().end(), bvh.buffer.bytes().begin()));
  }
}

TEST_CASE("a file without shapes has no shape sections") {
  const std::vector<Box> boxes{{{0, 0, 0}, {1, 1, 1}}};
  const build::Bvh bvh = built({.boxes = boxes});
  const BufferView view = *open_buffer(bvh.buffer.bytes());
  CHECK(view.header->section_count == 5);
  CHECK(view.shapes.empty());
  CHECK(view.points_of(0).empty());
}

TEST_CASE("shapes without primitives give a valid file") {
  const build::Bvh bvh = built({.boxes = {}, .shapes = {ShapeKind::kCurves, {}, {}}});
  CHECK(open_buffer(bvh.buffer.bytes())->shapes[0].kind == ShapeKind::kCurves);
}

TEST_CASE("an exported tree over shapes is imported with them") {
  const Wig wig;
  const auto boxes = boxes_of(wig.shapes());
  const build::CustomGeometry custom{.boxes = boxes, .shapes = wig.shapes()};
  const build::Bvh bvh = built(custom);
  const auto tree = build::export_tree(*open_buffer(bvh.buffer.bytes()));
  REQUIRE(tree.has_value());
  const auto imported = build::import_tree({{}, {&custom, 1}}, *tree);
  REQUIRE(imported.has_value());
  REQUIRE(validate(imported->buffer.bytes()));
  CHECK(open_buffer(imported->buffer.bytes())->points_of(0).size() == wig.points.size());
}

TEST_CASE("a refit moves points with boxes, and refuses other shapes") {
  Wig wig;
  const auto boxes = boxes_of(wig.shapes());
  build::Bvh bvh = built({.boxes = boxes, .shapes = wig.shapes()});
  for (ShapePoint& point : wig.points) point.position[1] += 2.5f;
  const auto moved = boxes_of(wig.shapes());
  build::CustomGeometry custom{.boxes = moved, .shapes = wig.shapes()};
  const auto refitted = build::refit(bvh.buffer.bytes(), {{}, {&custom, 1}});
  INFO((refitted ? "" : refitted.error().message));
  REQUIRE(refitted.has_value());
  const auto valid = validate(bvh.buffer.bytes());
  INFO((valid ? "" : to_string(valid.error())));
  REQUIRE(valid.has_value());
  CHECK(open_buffer(bvh.buffer.bytes())->points_of(0)[4].position[1] == 6.5f);

  const auto refused = [&](const build::CustomGeometry& other) {
    const std::vector<std::byte> before(bvh.buffer.bytes().begin(), bvh.buffer.bytes().end());
    const auto result = build::refit(bvh.buffer.bytes(), {{}, {&other, 1}});
    REQUIRE_FALSE(result.has_value());
    CHECK(std::equal(before.begin(), before.end(), bvh.buffer.bytes().begin()));
    return result.error().message;
  };
  CHECK_THAT(refused({.boxes = moved}),
             Contains("custom primitives without shapes, but in the file to refit they are curves"));
  Wig other = wig;
  other.points.pop_back();
  other.segments[2] = 3;
  const auto other_boxes = boxes_of(other.shapes());
  CHECK_THAT(refused({.boxes = other_boxes, .shapes = other.shapes()}),
             Contains("5 points of shapes, but the file to refit has 6"));
  other = wig;
  other.segments[2] = 3;
  const auto third = boxes_of(other.shapes());
  CHECK_THAT(refused({.boxes = third, .shapes = other.shapes()}),
             Contains("segment 2 begins at point 3, but in the file to refit at 4"));
}

TEST_CASE("a scene of instances stores the offsets of its objects' shapes") {
  const Wig wig;
  const auto boxes = boxes_of(wig.shapes());
  const build::Bvh with = built({.boxes = boxes, .shapes = wig.shapes()}), plain = built({.boxes = boxes});
  const std::vector<std::span<const std::byte>> files{plain.buffer.bytes(), with.buffer.bytes()};
  const std::vector<build::Instance> low{{.object = 1}}, top{{.object = 2}, {.object = 0}};
  const std::vector<std::span<const build::Instance>> groups{low, top};
  const auto scene = build::build_instances(build::InstancedScene{files, groups});
  REQUIRE(scene.has_value());
  REQUIRE(validate(scene->buffer.bytes()));
  const BufferView view = *open_buffer(scene->buffer.bytes());
  REQUIRE(view.object_shapes.size() == 3);
  CHECK(view.object_shapes[0] == 0);
  CHECK(view.object_shapes[1] == open_buffer(with.buffer.bytes())->shape_entry.offset);
  CHECK(view.object_shapes[2] == 0);
  const auto without = build::build_instances(std::span(files).first(1), std::span(top).last(1));
  REQUIRE(without.has_value());
  CHECK(open_buffer(without->buffer.bytes())->object_shapes.empty());
}
