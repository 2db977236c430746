// Builds of custom primitives: alone and beside meshes, in every layout, by every builder.

#include <hiprt_build/build.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/pair/custom_pair.h>
#include <hiprt_build/statistics.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/catch.h>

#include <bit>

using namespace hiprt;
using namespace hiprt::oracle;
using build::Builder;
using build::CustomGeometry;
using build::SceneInput;

namespace {

constexpr NodeLayout kLayouts[] = {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized};
constexpr Builder kBuilders[] = {Builder::kSah,      Builder::kLbvh,        Builder::kPloc,
                                 Builder::kHploc,    Builder::kSbvh,        Builder::kHq,
                                 oracle::kEmbreeLow, oracle::kEmbreeMedium, oracle::kEmbreeHigh};
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::uint64_t kSeed = 31;

/// Boxes of segments along random strands: neighbours in the list touch.
std::vector<Box> strands(unsigned count, unsigned segments, std::uint64_t seed) {
  Random random(seed);
  std::vector<Box> boxes;
  for (unsigned i = 0; i < count; ++i) {
    Position p = random.in_cube(1);
    for (unsigned k = 0; k < segments; ++k) {
      const Position step = random.in_cube(0.03);
      Box box{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float next = p[axis] + step[axis], radius = 0.002f;
        box.min[axis] = std::min(p[axis], next) - radius;
        box.max[axis] = std::max(p[axis], next) + radius;
        p[axis] = next;
      }
      boxes.push_back(box);
    }
  }
  return boxes;
}

bool same_bits(const Box& a, const Box& b) {
  using Bits = std::array<std::uint32_t, 6>;
  return std::bit_cast<Bits>(a) == std::bit_cast<Bits>(b);
}

build::Bvh built(const SceneInput& scene, const build::BuildOptions& options = {}) {
  auto bvh = build::build(scene, options);
  INFO((bvh ? "" : bvh.error().message));
  REQUIRE(bvh.has_value());
  const auto valid = validate(bvh->buffer.bytes());
  INFO((valid ? "" : to_string(valid.error())));
  REQUIRE(valid);
  CHECK(valid->leaf_triangles + valid->leaf_customs + valid->dropped == valid->primitives);
  return std::move(*bvh);
}

BufferView view_of(const build::Bvh& bvh) {
  const auto view = open_buffer(bvh.buffer.bytes());
  REQUIRE(view);
  return *view;
}

/// The custom primitive that the map places in a leaf has the input's box there.
void check_boxes(const BufferView& view, std::span<const CustomGeometry> customs) {
  const auto leaves = view.records<CustomLeaf>(view.leaves);
  const std::size_t meshes = view.geometries.size() - customs.size();
  unsigned wrong = 0, held = 0;
  for (std::size_t g = 0; g < customs.size(); ++g)
    for (std::size_t i = 0; i < customs[g].boxes.size(); ++i) {
      const std::uint32_t entry = view.primitive_map[view.geometries[meshes + g].first_primitive + i];
      if (entry == kInvalidId) continue;
      ++held;
      const CustomLeaf& leaf = leaves[entry / 2];
      const bool good = same_bits(leaf.box[entry % 2], customs[g].boxes[i]) && leaf.info.primitive[entry % 2] == i &&
                        (leaf.info.geometry_and_flags & kGeometryMask) == meshes + g;
      wrong += good ? 0 : 1;
    }
  CHECK(wrong == 0);
  CHECK(held > 0);
}

/// Primitives in the longest run of each kind.
struct LongestRuns {
  unsigned triangles = 0, customs = 0;
};
LongestRuns longest_runs(const BufferView& view) {
  LongestRuns result;
  unsigned run = 0;
  for (const CustomLeaf& leaf : view.records<CustomLeaf>(view.leaves)) {
    run += leaf.info.primitive[1] == kInvalidId ? 1 : 2;
    const std::uint32_t flags = view.geometries[leaf.info.geometry_and_flags & kGeometryMask].flags;
    unsigned& longest = (flags & kGeometryCustom) != 0 ? result.customs : result.triangles;
    longest = std::max(longest, run);
    if ((leaf.info.geometry_and_flags & kLastInRun) != 0) run = 0;
  }
  return result;
}

}  // namespace

TEST_CASE("custom primitives beside meshes, in every layout, by every builder") {
  const std::vector<Mesh> meshes{star(4, 1), icosphere(2)};
  const std::vector<Box> hair = strands(200, 9, kSeed), cloud = strands(500, 1, kSeed + 1);
  const std::vector<CustomGeometry> customs{{hair, 7, 0xffffffffu, "hair"}, {cloud, 255, 5, "cloud"}};
  const auto views = oracle::views(meshes);
  for (const NodeLayout layout : kLayouts)
    for (const Builder builder : kBuilders) {
      CAPTURE(static_cast<std::uint32_t>(layout), build::name(builder));
      const build::Bvh bvh = built({views, customs}, {.builder = builder, .nodes = layout});
      const BufferView view = view_of(bvh);
      CHECK(view.header->features ==
            (feature_bit(Feature::kTriangles) | feature_bit(Feature::kCustom) | feature_bit(Feature::kMasks)));
      CHECK(view.geometries.size() == 4);
      CHECK(view.geometries[1].flags == 0);
      CHECK(view.geometries[2].flags == custom_geometry_flags(7));
      CHECK(view.geometries[3].flags == custom_geometry_flags(255));
      CHECK(view.geometries[3].mask == 5);
      check_boxes(view, customs);
      CHECK(bvh.statistics.customs == hair.size() + cloud.size());
      CHECK(bvh.statistics.triangles == meshes[0].triangles.size() + meshes[1].triangles.size());
      CHECK(bvh.statistics.builder == (builder == oracle::kEmbreeHigh ? oracle::kEmbreeMedium : builder));
      const std::string provenance(view.provenance);
      CHECK(provenance.find("\"builder\":\"" + std::string(build::name(builder)) + "\"") != std::string::npos);
      CHECK(provenance.find("\"builder\":\"" + std::string(build::name(bvh.statistics.builder)) + "\"") !=
            std::string::npos);
      CHECK(provenance.find("\"name\":\"hair\",\"customs\":1800,\"type\":7") != std::string::npos);
      const build::TreeStatistics tree = build::measure_tree(view);
      CHECK(tree.leaf_customs == bvh.statistics.customs);
      CHECK(tree.leaf_triangles == bvh.statistics.triangles);
      CHECK(tree.custom_leaves == bvh.statistics.customs - bvh.statistics.custom_pairs);
    }
}

TEST_CASE("scenes of custom primitives alone, of one, and of none") {
  const std::vector<Box> boxes = strands(100, 5, kSeed);
  for (const NodeLayout layout : kLayouts) {
    const std::vector<CustomGeometry> customs{{boxes}};
    const build::Bvh bvh = built({{}, customs}, {.nodes = layout});
    CHECK(view_of(bvh).header->features == feature_bit(Feature::kCustom));
    check_boxes(view_of(bvh), customs);

    const std::vector<CustomGeometry> single{{std::span(boxes).first(1), 3}};
    const build::Bvh one = built({{}, single}, {.nodes = layout});
    CHECK(ref_type(view_of(one).header->root) == NodeType::kProcedural);
    CHECK(same_bits(view_of(one).header->bounds, boxes[0]));

    const std::vector<CustomGeometry> nothing{{{}, 3}};
    const build::Bvh none = built({{}, nothing}, {.nodes = layout});
    CHECK(view_of(none).header->features == 0);
    CHECK(view_of(none).header->root == kInvalidRef);
    CHECK(view_of(none).geometries[0].flags == custom_geometry_flags(3));
    CHECK(view_of(built(SceneInput{}, {.nodes = layout})).geometries.empty());
  }
}

TEST_CASE("boxes that are not finite or inverted are dropped and counted") {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const Box good{{0, 0, 0}, {1, 1, 1}}, point{{1, 2, 3}, {1, 2, 3}};
  std::vector<Box> boxes(9, good);
  boxes[1].min[0] = kNan;
  boxes[2].max[2] = kInfinity;
  boxes[3].min[1] = -kInfinity;
  boxes[5].min[2] = std::nextafter(1.0f, 2.0f);
  boxes[6] = {{kInfinity, 0, 0}, {-kInfinity, 1, 1}};
  boxes[7] = point;
  const std::vector<CustomGeometry> customs{{boxes}};
  const build::Bvh bvh = built({{}, customs});
  CHECK(bvh.statistics.dropped_not_finite == 4);
  CHECK(bvh.statistics.dropped_degenerate == 1);
  const BufferView view = view_of(bvh);
  CHECK(view.geometries[0].dropped_count == 5);
  for (std::size_t i = 0; i < boxes.size(); ++i)
    CHECK((view.primitive_map[i] == kInvalidId) == (i == 1 || i == 2 || i == 3 || i == 5 || i == 6));
}

TEST_CASE("neighbours share a leaf when their common box is small") {
  const auto cube = [](float x) { return Box{{x, 0, 0}, {x + 1, 1, 1}}; };
  // Half areas: of a cube 3, of two cubes d apart 2 (2 + d) + 1. The limit is 1.25 * 6 = 7.5: d = 1.25.
  const std::vector<Box> near{cube(0), cube(2.25f)}, far{cube(0), cube(2.5f)}, three{cube(0), cube(10), cube(11)};
  const std::vector<Box> points(4, Box{{1, 1, 1}, {1, 1, 1}});
  const auto pairs = [](std::span<const Box> boxes, const build::BuildOptions& options = {}) {
    const std::vector<CustomGeometry> customs{{boxes}};
    return built({{}, customs}, options).statistics.custom_pairs;
  };
  CHECK(pairs(near) == 1);
  CHECK(pairs(far) == 0);
  // 1 and 2 are neighbours, but not 2 i and 2 i + 1.
  CHECK(pairs(three) == 0);
  CHECK(pairs(points) == 2);
  CHECK(pairs(near, {.pair_triangles = false}) == 0);
  CHECK(pairs(near, {.max_leaf_triangles = 1}) == 0);
  // Two geometries do not share.
  const std::vector<CustomGeometry> customs{{std::span(near).first(1)}, {std::span(near).last(1)}};
  CHECK(built({{}, customs}).statistics.custom_pairs == 0);
}

TEST_CASE("the area limit for two custom primitives in a leaf is near the break-even point") {
  const build::SahCosts costs;
  const float even = costs.custom / (costs.custom - costs.box_node / 3);
  CHECK(build::kCustomPairArea <= even);
  CHECK(build::kCustomPairArea > 0.9f * even);
}

TEST_CASE("runs hold one kind of leaf, and at most max_leaf_triangles primitives") {
  const std::vector<Mesh> meshes{soup(300, 0.3, kSeed)};
  const std::vector<Box> boxes = strands(100, 4, kSeed);
  const std::vector<CustomGeometry> customs{{boxes}};
  const auto views = oracle::views(meshes);
  for (const unsigned limit : {1u, 2u, 3u, 8u}) {
    // Box nodes so dear that runs are as long as they may be. validate() refuses mixed ones.
    const build::Bvh bvh = built(
        {views, customs}, {.max_leaf_triangles = limit, .costs = {.box_node = 1000, .leaf = 0.01f, .custom = 0.01f}});
    const LongestRuns longest = longest_runs(view_of(bvh));
    CHECK(longest.triangles == limit);
    CHECK(longest.customs == limit);
  }
}

TEST_CASE("the collapse predicts the measured cost of custom primitives") {
  const std::vector<Mesh> meshes{star(4, 3)};
  const std::vector<Box> boxes = strands(300, 7, kSeed);
  const std::vector<CustomGeometry> customs{{boxes}};
  const auto views = oracle::views(meshes);
  const build::SahCosts costs{1.0f, 0.7f, 3.1f};
  const build::Bvh bvh = built({views, customs}, {.costs = costs});
  const std::string text(view_of(bvh).provenance);
  const std::size_t at = text.find("\"sah_cost\":");
  REQUIRE(at != std::string::npos);
  CHECK(std::stod(text.substr(at + 11)) == Approx(build::measure_tree(view_of(bvh), costs).sah_cost).epsilon(1e-4));
}

TEST_CASE("custom primitives that cannot be built are refused with their numbers") {
  Box large{{0, 0, 0}, {1, 0x1p126f, 1}};
  const std::vector<Box> boxes{{{0, 0, 0}, {1, 1, 1}}, {{5, 0, 0}, {6, 1, 1}}, large};
  const std::vector<CustomGeometry> customs{{std::span(boxes).first(2)}, {boxes, 1, 1, "hair"}};
  const auto refused = build::build(SceneInput{{}, customs}, {.nodes = NodeLayout::kQuantized});
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == build::ErrorCode::kInvalidInput);
  CHECK_THAT(refused.error().message,
             Catch::Contains("custom geometry 1 (hair), primitive 2: ") && Catch::Contains("2^126"));
  for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf})
    built({{}, customs}, {.nodes = layout});

  // Refused by its size alone: the memory behind the span is never looked at.
  const std::vector<CustomGeometry> many{{{boxes.data(), std::size_t{1} << 30}},
                                         {{boxes.data(), std::size_t{1} << 30}}};
  const auto too_many = build::build(SceneInput{{}, many});
  REQUIRE_FALSE(too_many.has_value());
  CHECK(too_many.error().code == build::ErrorCode::kTooLarge);
  CHECK_THAT(too_many.error().message, Catch::Contains("2147483648 primitives, the limit is 2147483647"));
}

TEST_CASE("extreme custom boxes") {
  Random random(kSeed);
  for (const double size : {1e-44, 1e-38, 1e-3, 1e7, 1e37}) {
    INFO("seed " << kSeed << ", size " << size);
    std::vector<Box> boxes(500);
    for (Box& box : boxes)
      for (unsigned axis = 0; axis < 3; ++axis) {
        const float a = random.uniform_float(-size, size), b = random.coin() ? a : random.uniform_float(-size, size);
        box.min[axis] = std::min(a, b);
        box.max[axis] = std::max(a, b);
      }
    const std::vector<CustomGeometry> customs{{boxes}};
    for (const NodeLayout layout : kLayouts)
      for (const Builder builder : kBuilders)
        check_boxes(view_of(built({{}, customs}, {.builder = builder, .nodes = layout})), customs);
  }
}

TEST_CASE("a build with custom primitives does not depend on the number of threads") {
  const std::vector<Mesh> meshes{star(5, 3)};
  const std::vector<Box> boxes = strands(3000, 9, kSeed);
  const std::vector<CustomGeometry> customs{{boxes}};
  const auto views = oracle::views(meshes);
  const build::Bvh one = built({views, customs}, {.threads = 1}), many = built({views, customs}, {.threads = 4});
  REQUIRE(one.buffer.size() == many.buffer.size());
  CHECK(std::equal(one.buffer.bytes().begin(), one.buffer.bytes().end(), many.buffer.bytes().begin()));
}
