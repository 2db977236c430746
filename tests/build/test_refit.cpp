// Refits change what they must and nothing else, in every layout; and what they refuse.

#include <hiprt_build/refit.h>
#include <hiprt_build/statistics.h>
#include <hiprt_device/format/validate.h>
#include <tests/build/tight_boxes.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/motions.h>
#include <tests/oracle/odd_meshes.h>

#include <catch2/catch.hpp>

#include <cstring>
#include <set>
#include <string>

using namespace hiprt;
using namespace hiprt::oracle;
using build::Builder;
using build::BuildOptions;
using build::CustomGeometry;
using build::ErrorCode;
using build::SceneInput;
using Catch::Contains;

namespace {

constexpr NodeLayout kLayouts[] = {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized};
constexpr Builder kBuilders[] = {Builder::kSah,  Builder::kLbvh,         Builder::kPloc,       Builder::kHploc,
                                 Builder::kSbvh, Builder::kEmbreeMedium, Builder::kEmbreeHigh, Builder::kHq};
constexpr std::uint64_t kSeed = 4711;

/// A built file with what was put in.
struct File {
  build::Bvh bvh;

  std::span<std::byte> bytes() { return bvh.buffer.bytes(); }
  std::string copy() { return {reinterpret_cast<const char*>(bytes().data()), bytes().size()}; }
  BufferView view() {
    const auto view = open_buffer(bytes());
    REQUIRE(view);
    return *view;
  }
  bool has_splits() { return (view().header->features & feature_bit(Feature::kSplitReferences)) != 0; }
};

void check_valid(std::span<const std::byte> bytes) {
  const auto valid = validate(bytes);
  INFO((valid ? "" : to_string(valid.error())));
  REQUIRE(valid);
}

File built(const SceneInput& scene, const BuildOptions& options = {}) {
  auto bvh = build::build(scene, options);
  INFO((bvh ? "" : bvh.error().message));
  REQUIRE(bvh.has_value());
  return {std::move(*bvh)};
}
File built(const Mesh& mesh, const BuildOptions& options = {}) {
  const std::vector meshes{mesh.view()};
  return built(SceneInput{meshes, {}}, options);
}

build::RefitStatistics refitted(File& file, const SceneInput& moved, const build::RefitOptions& options = {}) {
  const auto result = build::refit(file.bytes(), moved, options);
  INFO((result ? "" : result.error().message));
  REQUIRE(result.has_value());
  check_valid(file.bytes());
  return *result;
}
build::RefitStatistics refitted(File& file, const Mesh& moved, const build::RefitOptions& options = {}) {
  const std::vector meshes{moved.view()};
  return refitted(file, SceneInput{meshes, {}}, options);
}

/// What is refused leaves the file as it was.
build::Error refusal(File& file, const SceneInput& moved, const build::RefitOptions& options = {}) {
  const std::string before = file.copy();
  const auto result = build::refit(file.bytes(), moved, options);
  REQUIRE_FALSE(result.has_value());
  CHECK((file.copy() == before));
  const auto copied = build::refit_copy(file.bytes(), moved, options);
  REQUIRE_FALSE(copied.has_value());
  CHECK(copied.error().message == result.error().message);
  CHECK(result.error().message.find('\n') == std::string::npos);
  return result.error();
}
build::Error refusal(File& file, const Mesh& moved) {
  const std::vector meshes{moved.view()};
  return refusal(file, SceneInput{meshes, {}});
}

/// Every triangle of every leaf has, in the order that its id byte says, the mesh's corners.
template <class Layout> unsigned wrong_corners(const BufferView& view, const Mesh& mesh) {
  unsigned wrong = 0;
  for (const auto& leaf : view.records<typename Layout::Leaf>(view.leaves))
    for (unsigned which = 0; which < (leaf.info.primitive[1] == kInvalidId ? 1u : 2u); ++which) {
      const std::uint32_t id = leaf.info.triangle_ids >> (8 * which) & 0xffu;
      const unsigned u = TriangleId::u_source(id), v = TriangleId::v_source(id), source[] = {3 - u - v, u, v};
      const auto corners = format_detail::leaf_triangle<Layout>(leaf, which);
      const Triangle& triangle = mesh.triangles[leaf.info.primitive[which]];
      for (unsigned k = 0; k < 3; ++k)
        for (unsigned axis = 0; axis < 3; ++axis)
          wrong += corners.corner[source[k]][axis] == mesh.positions[triangle[k]][axis] ? 0 : 1;
    }
  return wrong;
}

void check_moved(File& file, const Mesh& moved) {
  const BufferView view = file.view();
  CHECK(dispatch_layout(view.layout(), [&](auto layout) { return wrong_corners<decltype(layout)>(view, moved); }) == 0);
  if (!file.has_splits()) test::check_tight_boxes(view);
}

struct Scene {
  const char* name;
  Mesh mesh;
};
std::vector<Scene> scenes() {
  return {{"sphere", icosphere(4)},
          {"star", star(4, kSeed)},
          {"soup", soup(2000, 0.3, kSeed)},
          {"needles", needles(1000, 1e4, kSeed)},
          {"identical", identical(200)},
          {"flat", grid_plane(30, 1, 0.25f)},
          {"beyond the halves", placed(star(3, kSeed), 1e5, {1e5, -3e5, 0})},
          {"with dropped ones", torture(400, kSeed)}};
}

bool fits(const Scene& scene, NodeLayout layout) {
  return layout != NodeLayout::kQuantized || std::string(scene.name) != "with dropped ones";
}

}  // namespace

TEST_CASE("a refit of what has not moved changes no byte") {
  for (const Scene& scene : scenes())
    for (const NodeLayout layout : kLayouts)
      for (const Builder builder : kBuilders) {
        if (!fits(scene, layout)) continue;
        CAPTURE(scene.name, static_cast<std::uint32_t>(layout), build::name(builder));
        File file = built(scene.mesh, {.builder = builder, .nodes = layout});
        const std::string before = file.copy();
        const build::RefitStatistics statistics = refitted(file, scene.mesh);
        CHECK(statistics.nodes == file.view().nodes.count);
        CHECK(statistics.leaves == file.view().leaves.count);
        // Of split references the boxes grow to the whole triangles'; Embree's boxes of odd sizes are not all tight.
        const bool loose = std::string(build::name(builder)).starts_with("embree") && !fits(scene, kLayouts[3]);
        if (!file.has_splits() && !loose) CHECK((file.copy() == before));
        check_moved(file, scene.mesh);
      }
}

TEST_CASE("after a motion vertices are the mesh's and boxes as small as the layout allows, in every layout") {
  for (const Scene& scene : {scenes()[0], scenes()[1], scenes()[2], scenes()[5], scenes()[6]})
    for (const NodeLayout layout : kLayouts)
      for (const Builder builder : kBuilders) {
        CAPTURE(scene.name, static_cast<std::uint32_t>(layout), build::name(builder));
        File file = built(scene.mesh, {.builder = builder, .nodes = layout});
        for (const Mesh& moved : {twisted(scene.mesh, 0.3), waved(scene.mesh, 0.2), shaken(scene.mesh, 0.5, kSeed),
                                  placed(scene.mesh, 1e-3, {1, 2, -3}), placed(scene.mesh, 1e6, {0, 2e6, 0})}) {
          refitted(file, moved);
          check_moved(file, moved);
          const Box bounds = file.view().header->bounds;
          File fresh = built(moved, {.nodes = layout});
          const Box wanted = fresh.view().header->bounds;
          if (layout == NodeLayout::kFloat || layout == NodeLayout::kPlanes)
            CHECK(format_detail::first_different_plane(bounds, wanted) == format_detail::kNoPlane);
        }
        // And back.
        const std::string before = built(scene.mesh, {.builder = builder, .nodes = layout}).copy();
        refitted(file, scene.mesh);
        if (!file.has_splits() && layout != NodeLayout::kQuantized) CHECK((file.copy() == before));
      }
}

TEST_CASE("infinite planes of layout half are the moved scene's bounds") {
  const Mesh mesh = star(3, kSeed), far = placed(mesh, 1e5, {0, 0, 1e6});
  File file = built(mesh, {.nodes = NodeLayout::kHalf}), planes = built(far);
  refitted(file, far);
  const Box rough = file.view().header->bounds, exact = planes.view().header->bounds;
  CHECK(rough.max[2] == exact.max[2]);
  CHECK(rough.max[0] == exact.max[0]);
  CHECK(rough.min[0] == exact.min[0]);
  CHECK(rough.min[2] == 65504);
  refitted(file, mesh);
  CHECK(file.view().header->bounds.max[2] < 1.01f);
}

TEST_CASE("no primitive, one, two, three, and around powers of two") {
  for (const unsigned count : {0u, 1u, 2u, 3u, 4u, 5u, 7u, 8u, 9u, 15u, 16u, 17u, 63u, 64u, 65u})
    for (const NodeLayout layout : kLayouts)
      for (const unsigned leaf : {1u, 8u}) {
        CAPTURE(count, static_cast<std::uint32_t>(layout), leaf);
        const Mesh mesh = soup(count, 0.5, kSeed + count), moved = shaken(mesh, 1, kSeed);
        File file = built(mesh, {.nodes = layout, .max_leaf_triangles = leaf, .pair_triangles = leaf > 1});
        const std::string before = file.copy();
        refitted(file, moved);
        check_moved(file, moved);
        CHECK((file.copy() == before) == (count == 0));
        refitted(file, mesh);
        if (layout != NodeLayout::kQuantized) CHECK((file.copy() == before));
      }
  File nothing = built(SceneInput{});
  CHECK(refitted(nothing, SceneInput{}).cost_ratio == 1);
}

TEST_CASE("extreme places: one point, one line, denormals, the largest floats") {
  const Mesh mesh = star(3, kSeed);
  constexpr float kMax = std::numeric_limits<float>::max();
  Mesh point = mesh, line = mesh, corners = mesh;
  for (Position& p : point.positions) p = {1, -2, 3};
  for (Position& p : line.positions) p = {0, p[1], 0};
  for (Position& p : corners.positions)
    for (float& x : p) x = x < 0 ? -kMax : kMax;
  for (const NodeLayout layout : kLayouts)
    for (const bool pair : {false, true})
      for (const Mesh& moved :
           {point, line, placed(mesh, 1e-40), placed(mesh, 1e-45), placed(mesh, 3e37), placed(mesh, 3e38), corners}) {
        CAPTURE(static_cast<std::uint32_t>(layout), pair, moved.positions[0][0], moved.positions[0][1]);
        File file = built(mesh, {.nodes = layout, .pair_triangles = pair});
        if (layout == NodeLayout::kQuantized && extent(moved).radius > 8e37) {
          const build::Error error = refusal(file, moved);
          CHECK(error.code == ErrorCode::kInvalidInput);
          CHECK_THAT(error.message, Contains("mesh 0, triangle ") && Contains("2^126"));
          continue;
        }
        const build::RefitStatistics statistics = refitted(file, moved);
        check_moved(file, moved);
        CHECK(std::isfinite(statistics.sah_cost));
        CHECK(std::isfinite(statistics.cost_ratio));
        if (moved.positions == point.positions) CHECK_FALSE(statistics.rebuild_advised);
      }
}

TEST_CASE("custom primitives beside meshes") {
  Random random(kSeed);
  INFO("seed " << kSeed);
  const auto boxes = [&] {
    std::vector<Box> result;
    for (int i = 0; i < 300; ++i) {
      const Position p = random.in_cube(1), q = random.in_cube(1);
      Box box{};
      for (std::size_t k = 0; k < 3; ++k) box.min[k] = std::min(p[k], q[k]), box.max[k] = std::max(p[k], q[k]);
      result.push_back(box);
    }
    return result;
  };
  const Mesh mesh = star(3, kSeed), moved_mesh = twisted(mesh, 0.4);
  std::vector<Box> first = boxes();
  const std::vector<Box> second = boxes(), moved_second = boxes();
  std::vector<Box> moved_first = boxes();
  first[7].min[1] = moved_first[7].min[1] = std::numeric_limits<float>::quiet_NaN();
  const std::vector meshes{mesh.view()}, moved_meshes{moved_mesh.view()};
  const std::vector<CustomGeometry> customs{{first, 3}, {second, 200, 5}}, moved{{moved_first, 3}, {moved_second, 200}};
  for (const NodeLayout layout : kLayouts) {
    CAPTURE(static_cast<std::uint32_t>(layout));
    File file = built(SceneInput{meshes, customs}, {.nodes = layout});
    const std::string before = file.copy();
    refitted(file, SceneInput{meshes, customs});
    CHECK((file.copy() == before));
    refitted(file, SceneInput{moved_meshes, moved});
    const BufferView view = file.view();
    test::check_tight_boxes(view);
    CHECK(view.geometries[2].mask == 5);
    unsigned wrong = 0;
    for (std::size_t i = 0; i < 600; ++i) {
      const std::uint32_t at = view.primitive_map[mesh.triangles.size() + i];
      if (i == 7) {
        CHECK(at == kInvalidId);
        continue;
      }
      const Box& there = view.records<CustomLeaf>(view.leaves)[at / 2].box[at % 2];
      const Box& wanted = i < 300 ? moved_first[i] : moved_second[i - 300];
      wrong += format_detail::first_different_plane(there, wanted) == format_detail::kNoPlane ? 0 : 1;
    }
    CHECK(wrong == 0);
    std::vector<Box> bad = moved_first;
    std::swap(bad[9].min[2], bad[9].max[2]);
    const auto wrong_scene = [&](std::vector<CustomGeometry> geometries) {
      return refusal(file, SceneInput{moved_meshes, geometries}).message;
    };
    CHECK_THAT(wrong_scene({{bad, 3, 1, "hair"}, {second, 200}}),
               Contains("custom geometry 0 (hair), primitive 9: ") && Contains("inverted"));
    bad[9].min[2] = -std::numeric_limits<float>::infinity();
    CHECK_THAT(wrong_scene({{bad, 3}, {second, 200}}), Contains("primitive 9: ") && Contains("not finite"));
    bad = boxes();
    CHECK_THAT(wrong_scene({{bad, 3}, {second, 200}}), Contains("primitive 7: ") && Contains("needs a new build"));
    CHECK_THAT(wrong_scene({{moved_first, 3}, {second, 201}}),
               Contains("custom geometry 1: type 201") && Contains("type 200"));
    CHECK_THAT(wrong_scene({{std::span(moved_first).first(299), 3}, {second, 200}}),
               Contains("299 primitives") && Contains("300"));
    CHECK_THAT(wrong_scene({{moved_first, 3}}), Contains("2 geometries") && Contains("has 3"));
    const std::vector<CustomGeometry> all{{first, 3}, {first, 3}, {second, 200}};
    CHECK_THAT(refusal(file, SceneInput{{}, all}).message,
               Contains("custom geometry 0: geometry 0 of the file") && Contains("a mesh"));
  }
}

TEST_CASE("what cannot be refitted is refused with the place, and the file stays") {
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

TEST_CASE("pairs whose common edge comes apart are refused; without pairs all can move") {
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

TEST_CASE("what is no file, and options out of range") {
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

namespace {

/// Puts a text into the place of the file's provenance.
void set_provenance(File& file, std::string text) {
  const BufferView view = file.view();
  text.resize(view.provenance.size(), ' ');
  std::memcpy(file.bytes().data() + view.provenance_entry.offset, text.data(), text.size());
  reinterpret_cast<FileHeader*>(file.bytes().data())->checksum = file_checksum(file.bytes());
}

}  // namespace

TEST_CASE("the tree as it was built stays the measure, refit after refit") {
  const Mesh mesh = unshared(star(5, kSeed));
  for (const NodeLayout layout : kLayouts) {
    CAPTURE(static_cast<std::uint32_t>(layout));
    const build::SahCosts costs{.box_node = 2, .leaf = 1};
    File file = built(mesh, {.nodes = layout, .pair_triangles = false, .costs = costs});
    const build::TreeStatistics tree = build::measure_tree(file.view(), costs);
    const auto check = [&](const Mesh& moved, bool advised) {
      const build::RefitStatistics s = refitted(file, moved);
      CHECK(s.sah_cost_built == Approx(tree.sah_cost).epsilon(layout == NodeLayout::kPlanes ? 1e-4 : 0.05));
      CHECK(s.exchange_slack_built == Approx(tree.exchange_slack).margin(1e-6));
      const build::TreeStatistics now = build::measure_tree(file.view(), costs);
      CHECK(s.sah_cost == Approx(now.sah_cost));
      CHECK(s.exchange_slack == Approx(now.exchange_slack).margin(1e-9));
      CHECK(s.cost_ratio == Approx(s.sah_cost / s.sah_cost_built));
      CHECK(s.rebuild_advised == advised);
      return s.cost_ratio;
    };
    CHECK(check(mesh, false) == Approx(1).epsilon(0.05));
    // Halves are no grid for what is much smaller or larger.
    for (const double scale : {1e-20, 1e-3, 3.0, 1e15})
      if (layout != NodeLayout::kHalf || (scale > 1e-4 && scale < 1e4)) CHECK(check(placed(mesh, scale), false) < 1.06);
    check(exploded(mesh, 2, kSeed), true);
    check(scattered(mesh, 0.01, 3, kSeed), true);
    check(twisted(mesh, 0.05), false);
    CHECK(check(mesh, false) == Approx(1).epsilon(0.05));
  }
}

namespace {

/// TreeStatistics::exchange_slack from its definition.
double slack_of(const BufferView& view) {
  const auto nodes = view.records<PlanesBoxNode>(view.nodes);
  const auto area = [](const Box& box) {
    const double x = double{box.max[0]} - double{box.min[0]}, y = double{box.max[1]} - double{box.min[1]},
                 z = double{box.max[2]} - double{box.min[2]};
    return x * y + y * z + z * x;
  };
  double saved = 0, all = 0;
  for (const PlanesBoxNode& parent : nodes)
    for (unsigned c = 0; c < kBranching; ++c) {
      if (parent.child[c] == kInvalidRef || !is_box(parent.child[c])) continue;
      const PlanesBoxNode& child = nodes[(ref_offset(parent.child[c]) - view.nodes.offset) / sizeof(PlanesBoxNode)];
      std::vector<Box> nephews, siblings;
      for (unsigned k = 0; k < kBranching; ++k) {
        if (child.child[k] != kInvalidRef) nephews.push_back(PlanesLayout::box(child, k));
        if (k != c && parent.child[k] != kInvalidRef) siblings.push_back(PlanesLayout::box(parent, k));
      }
      const double before = area(PlanesLayout::box(parent, c));
      double best = before;
      for (std::size_t out = 0; out < nephews.size(); ++out)
        for (const Box& in : siblings) {
          std::vector<Box> exchanged = nephews;
          exchanged[out] = in;
          Box box = in;
          for (const Box& part : exchanged) format_detail::grow(box, part);
          best = std::min(best, area(box));
        }
      saved += before - best;
      all += before;
    }
  return all > 0 ? saved / all : 0;
}

}  // namespace

TEST_CASE("exchange slack is what it is defined as: little when built, more after random motions") {
  for (const Builder builder : {Builder::kSah, Builder::kLbvh, Builder::kHploc}) {
    const Mesh mesh = soup(5000, 0.1, kSeed);
    CAPTURE(build::name(builder));
    File file = built(mesh, {.builder = builder, .pair_triangles = false});
    const double before = build::measure_tree(file.view()).exchange_slack;
    CHECK(before == Approx(slack_of(file.view())));
    CHECK(before < 0.05);
    CHECK(file.view().provenance.find("\"exchange_slack\":0.0") != std::string_view::npos);
    CHECK(refitted(file, mesh).exchange_slack_built == Approx(before).margin(1e-6));
    refitted(file, scattered(mesh, 0.05, 2, kSeed));
    const double after = build::measure_tree(file.view()).exchange_slack;
    CHECK(after == Approx(slack_of(file.view())));
    CHECK(after > 0.2);
  }
}

TEST_CASE("split references are refitted whole, and the cost of that is seen") {
  const Mesh mesh = needles(5000, 1e3, kSeed);
  for (const Builder builder : {Builder::kHq, Builder::kSbvh, Builder::kEmbreeHigh}) {
    CAPTURE(build::name(builder));
    File file = built(mesh, {.builder = builder, .split_budget = 3});
    REQUIRE(file.has_splits());
    const build::RefitStatistics s = refitted(file, mesh, {.rebuild_slack = 1, .rebuild_ratio = 1.05});
    CHECK(s.cost_ratio > 1.05);
    CHECK(s.rebuild_advised);
    CHECK_FALSE(refitted(file, mesh, {.rebuild_slack = 1, .rebuild_ratio = 1000}).rebuild_advised);
    File whole = built(mesh, {.builder = builder, .split_budget = 1});
    CHECK_FALSE(whole.has_splits());
    CHECK(refitted(whole, mesh).cost_ratio == Approx(1).epsilon(1e-4));
  }
}

TEST_CASE("a file whose provenance says nothing is measured before the refit") {
  const Mesh mesh = unshared(star(4, kSeed)), worse = exploded(mesh, 2, kSeed);
  for (const std::string text :
       {"{}", "{\"statistics\":7}", "{\"statistics\":{\"sah_cost\":null,\"exchange_slack\":2}}",
        "{\"statistics\":{\"sah_cost\":-1}}", "{\"statistics\":{\"sah_cost\":\"12\"}}", "{[}",
        "{\"statistics\":{\"sah_cost\":1e999}}",
        "{\"options\":{\"cost_leaf\":1e300,\"cost_box_node\":-2,\"cost_custom\":[]}}"}) {
    CAPTURE(text);
    File file = built(mesh, {.pair_triangles = false});
    set_provenance(file, text);
    const build::TreeStatistics before = build::measure_tree(file.view());
    const build::RefitStatistics first = refitted(file, worse);
    CHECK(first.sah_cost_built == Approx(before.sah_cost));
    CHECK(first.exchange_slack_built == Approx(before.exchange_slack));
    CHECK(first.rebuild_advised);
    const build::RefitStatistics second = refitted(file, worse);
    CHECK(second.cost_ratio == Approx(1));
    CHECK_FALSE(second.rebuild_advised);
  }
  File file = built(mesh);
  set_provenance(file, "{\"statistics\":{\"sah_cost\":1e-3,\"exchange_slack\":0.5}}");
  const build::RefitStatistics s = refitted(file, mesh);
  CHECK(s.cost_ratio > 1000);
  CHECK(s.exchange_slack_built == 0.5);
}

TEST_CASE("a copy is refitted like the file in place") {
  const Mesh mesh = star(4, kSeed), moved = twisted(mesh, 0.5);
  File file = built(mesh);
  const std::string before = file.copy();
  const std::vector meshes{moved.view()};
  const auto copy = build::refit_copy(file.bytes(), SceneInput{meshes, {}});
  REQUIRE(copy.has_value());
  CHECK((file.copy() == before));
  CHECK(copy->statistics.scratch_bytes_peak >= file.bytes().size());
  refitted(file, moved);
  REQUIRE(copy->buffer.size() == file.bytes().size());
  CHECK(std::memcmp(copy->buffer.bytes().data(), file.bytes().data(), file.bytes().size()) == 0);
}

TEST_CASE("progress rises to the end; a cancel leaves the file whole") {
  const Mesh mesh = star(6, kSeed), moved = twisted(mesh, 0.25);
  const std::vector meshes{moved.view()};
  const SceneInput scene{meshes, {}};
  std::set<std::string> steps;
  double last = 0;
  File file = built(mesh);
  const std::string before = file.copy();
  refitted(file, moved, {.threads = 1, .progress = [&](const build::Progress& progress) {
                           CHECK(progress.fraction >= last);
                           CHECK(progress.fraction <= 1);
                           last = progress.fraction;
                           steps.insert(progress.step);
                           return true;
                         }});
  CHECK(steps == std::set<std::string>{"check", "refit", "checksum"});
  const std::string after = file.copy();
  for (const std::string& stop : steps) {
    CAPTURE(stop);
    const build::RefitOptions options{.progress = [&](const build::Progress& p) { return p.step != stop; }};
    File whole = built(mesh);
    const auto copy = build::refit_copy(whole.bytes(), scene, options);
    REQUIRE_FALSE(copy.has_value());
    CHECK(copy.error().code == ErrorCode::kCancelled);
    CHECK(copy.error().message == "the refit was cancelled");
    const auto result = build::refit(whole.bytes(), scene, options);
    // In place a refit that has begun to write goes on to the end.
    CHECK(result.has_value() == (stop == "checksum"));
    CHECK((whole.copy() == (stop == "checksum" ? after : before)));
  }
}
