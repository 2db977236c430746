// One tree in every layout: the files are valid, the leaves are equal, and boxes are rounded outwards by less than one
// step per level.

#include <hiprt_build/build.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/statistics.h>
#include <tests/amount.h>
#include <tests/build/tight_boxes.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/catch.h>

#include <cstring>

using namespace hiprt;
using namespace hiprt::oracle;

namespace {

constexpr NodeLayout kLayouts[] = {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized};

struct Scene {
  const char* name;
  Mesh mesh;
};

/// Triangles whose corners are neighbouring floats: as close to a scene in one point as there is.
Mesh point_scene(const Position& p) {
  Mesh mesh;
  for (int i = 0; i < 5; ++i) {
    const float up = std::nextafter(p[0], 1e38f), aside = std::nextafter(p[1], 1e38f);
    append(mesh, p, {up, p[1], p[2]}, {p[0], aside, p[2]});
  }
  return mesh;
}

std::vector<Scene> scenes() {
  return {{"sphere", icosphere(4)},
          {"star", star(4, 9)},
          {"soup", soup(3000, 0.1, 10)},
          {"large soup", soup(3000, 2, 11)},
          {"needles", needles(2000, 1e4, 12)},
          {"concentric", concentric(500, 13)},
          {"identical", identical(300)},
          {"flat", grid_plane(40, 1, 0.3f)},
          {"one triangle", identical(1)},
          {"one point", point_scene({1e7f, -3, 0})},
          {"one subnormal point", point_scene({1e-42f, -1e-42f, 0})},
          {"offset by 1e7", placed(star(4, 14), 1, {1e7, -1e7, 1e7})},
          {"beyond the halves", placed(star(4, 15), 1e5, {1e5, -3e5, 0})},
          {"huge", placed(star(4, 16), 1e37)},
          {"subnormal", placed(star(4, 17), 1e-40)},
          {"around the smallest normal", placed(star(4, 18), 2e-38)}};
}

struct Built {
  build::Bvh bvh;
  BufferView view;
};

Built built(const Mesh& mesh, const build::BuildOptions& options) {
  auto bvh = build::build(std::vector{mesh.view()}, options);
  INFO((bvh ? "" : bvh.error().message));
  REQUIRE(bvh.has_value());
  const auto valid = validate(bvh->buffer.bytes());
  INFO((valid ? "" : to_string(valid.error())));
  REQUIRE(valid);
  const auto view = open_buffer(std::as_const(bvh->buffer).bytes());
  REQUIRE(view);
  return {std::move(*bvh), *view};
}

/// Coordinates and ids of all leaves, as bits, whatever the layout.
template <class Layout> std::vector<std::uint32_t> leaf_bits(const BufferView& view) {
  std::vector<std::uint32_t> bits;
  for (const auto& leaf : view.records<typename Layout::Leaf>(view.leaves)) {
    for (unsigned v = 0; v < 4; ++v)
      for (unsigned axis = 0; axis < 3; ++axis)
        bits.push_back(std::bit_cast<std::uint32_t>(Layout::coordinate(leaf, v, axis)));
    for (const std::uint32_t word : std::bit_cast<std::array<std::uint32_t, 4>>(leaf.info)) bits.push_back(word);
  }
  return bits;
}

std::vector<std::uint32_t> leaf_bits(const BufferView& view) {
  return dispatch_layout(view.layout(), [&](auto layout) { return leaf_bits<decltype(layout)>(view); });
}

}  // namespace

TEST_CASE("one tree in every layout has the same leaves and tight boxes") {
  checks::Sample sample(2);
  for (const Scene& scene : scenes())
    for (const build::Builder builder : {build::Builder::kSah, oracle::kEmbreeMedium, oracle::kEmbreeHigh}) {
      if (!sample.next()) continue;
      const Built reference = built(scene.mesh, {.builder = builder, .nodes = NodeLayout::kPlanes});
      const std::vector<std::uint32_t> leaves = leaf_bits(reference.view);
      for (const NodeLayout layout : kLayouts) {
        CAPTURE(scene.name, build::name(builder), static_cast<std::uint32_t>(layout));
        const Built other = built(scene.mesh, {.builder = builder, .nodes = layout});
        CHECK(other.view.header->version_minor == kVersionMinor);
        CHECK(leaf_bits(other.view) == leaves);
        CHECK(other.view.node_count() == reference.view.node_count());
        const bool gaps = layout == NodeLayout::kPlanes && other.view.node_count() > 64;
        CHECK(other.view.nodes.stride == (gaps ? 64 : node_size(layout)));
        CHECK(std::equal(other.view.primitive_map.begin(), other.view.primitive_map.end(),
                         reference.view.primitive_map.begin(), reference.view.primitive_map.end()));
        const build::TreeStatistics tree = build::measure_tree(other.view), exact = build::measure_tree(reference.view);
        CHECK(std::isfinite(tree.sah_cost));
        CHECK(tree.leaf_runs == exact.leaf_runs);
        if ((other.view.header->features & feature_bit(Feature::kSplitReferences)) == 0)
          test::check_tight_boxes(other.view);
      }
    }
}

TEST_CASE("the same input gives the same bytes in every layout, with any number of threads") {
  const Mesh mesh = star(5, 21);
  for (const NodeLayout layout : kLayouts) {
    const Built one = built(mesh, {.nodes = layout, .threads = 1}), many = built(mesh, {.nodes = layout, .threads = 4});
    REQUIRE(one.view.bytes.size() == many.view.bytes.size());
    CHECK(std::memcmp(one.view.bytes.data(), many.view.bytes.data(), one.view.bytes.size()) == 0);
  }
}

TEST_CASE("bounds of layout half are finite: where planes are infinite, they are the scene's") {
  const Mesh mesh = placed(star(3, 22), 1e5, {0, 0, 1e6});
  const Built half = built(mesh, {.nodes = NodeLayout::kHalf}), planes = built(mesh, {.nodes = NodeLayout::kPlanes});
  const Box &rough = half.view.header->bounds, &exact = planes.view.header->bounds;
  CHECK(rough.max[2] == exact.max[2]);
  CHECK(rough.max[0] == exact.max[0]);
  CHECK(rough.min[0] == exact.min[0]);
  CHECK(rough.min[2] == 65504);
}

TEST_CASE("the SAH cost of rounded boxes") {
  for (const Scene& scene :
       {Scene{"sphere", icosphere(6)}, Scene{"star", star(6, 5)}, Scene{"soup", soup(20000, 0.05, 6)}}) {
    double cost[4] = {};
    for (unsigned i = 0; i < 4; ++i)
      cost[i] = build::measure_tree(built(scene.mesh, {.nodes = kLayouts[i]}).view).sah_cost;
    std::printf("%-8s SAH cost: planes %.3f, half %.3f (+ %.2f %%), quantized %.3f (+ %.2f %%)\n", scene.name, cost[1],
                cost[2], 100 * (cost[2] / cost[1] - 1), cost[3], 100 * (cost[3] / cost[1] - 1));
    CHECK(cost[0] == cost[1]);
    CHECK(cost[2] >= cost[1]);
    CHECK(cost[2] < 1.05 * cost[1]);
    CHECK(cost[3] >= cost[1]);
    CHECK(cost[3] < 1.05 * cost[1]);
  }
}
