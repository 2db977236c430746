// A refit changes boxes and vertices, and no other byte, in every layout.

#include <hiprt_build/format/view.h>
#include <tests/amount.h>
#include <tests/build/progress_watch.h>
#include <tests/build/refit_file.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/motions.h>
#include <tests/oracle/odd_meshes.h>

#include <cstring>
#include <set>

using namespace hiprt;
using namespace hiprt::oracle;
using namespace hiprt::test;
using build::Builder;
using build::CustomGeometry;
using build::ErrorCode;
using build::SceneInput;
using Catch::Contains;

namespace {

constexpr Builder kBuilders[] = {Builder::kSah,  Builder::kLbvh,        Builder::kPloc,      Builder::kHploc,
                                 Builder::kSbvh, oracle::kEmbreeMedium, oracle::kEmbreeHigh, Builder::kHq};

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

TEST_CASE("a refit without motion changes no byte") {
  checks::Sample sample(3);
  for (const Scene& scene : scenes())
    for (const NodeLayout layout : kLayouts)
      for (const Builder builder : kBuilders) {
        if (!sample.next() || !fits(scene, layout)) continue;
        CAPTURE(scene.name, static_cast<std::uint32_t>(layout), build::name(builder));
        File file = built(scene.mesh, {.builder = builder, .nodes = layout});
        const std::string before = file.copy();
        const build::RefitStatistics statistics = refitted(file, scene.mesh);
        CHECK(statistics.nodes == file.view().node_count());
        CHECK(statistics.leaves == file.view().leaves.count);
        CHECK((statistics.check_seconds > 0 && statistics.write_seconds > 0 && statistics.measure_seconds > 0));
        CHECK(statistics.check_seconds + statistics.write_seconds + statistics.measure_seconds <=
              statistics.total_seconds + 1e-9);
        // Of split references the boxes grow to the whole triangles'; Embree's boxes of odd sizes are not all tight.
        const bool loose = std::string(build::name(builder)).starts_with("embree") && !fits(scene, kLayouts[3]);
        if (!file.has_splits() && !loose) CHECK((file.copy() == before));
        check_moved(file, scene.mesh);
      }
}

TEST_CASE("after a refit vertices are the mesh's and boxes as small as the layout allows") {
  checks::Sample sample(3);
  for (const Scene& scene : {scenes()[0], scenes()[1], scenes()[2], scenes()[5], scenes()[6]})
    for (const NodeLayout layout : kLayouts)
      for (const Builder builder : kBuilders) {
        if (!sample.next()) continue;
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

TEST_CASE("infinite planes of layout half become the bounds of the moved scene") {
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

TEST_CASE("refits of zero to three primitives, and around powers of two") {
  for (const unsigned count : {0u, 1u, 2u, 3u, 4u, 5u, 7u, 8u, 9u, 15u, 16u, 17u, 63u, 64u, 65u})
    for (const NodeLayout layout : kLayouts)
      for (const unsigned leaf : {1u, 8u}) {
        CAPTURE(count, static_cast<std::uint32_t>(layout), leaf);
        const Mesh mesh = soup(count, 0.5, kSeed + count), moved = shaken(mesh, 1, kSeed);
        File file = built(
            mesh, {.builder = Builder::kSah, .nodes = layout, .max_leaf_triangles = leaf, .pair_triangles = leaf > 1});
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

TEST_CASE("refits to one point, one line, denormals, the largest floats") {
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

namespace {

constexpr std::size_t kCustoms = 300;

std::vector<Box> random_boxes(Random& random) {
  std::vector<Box> result;
  for (std::size_t i = 0; i < kCustoms; ++i) {
    const Position p = random.in_cube(1), q = random.in_cube(1);
    Box box{};
    for (std::size_t k = 0; k < 3; ++k) box.min[k] = std::min(p[k], q[k]), box.max[k] = std::max(p[k], q[k]);
    result.push_back(box);
  }
  return result;
}

/// A mesh and two custom geometries of types 3 and 200, before and after a motion. Primitive 7 of the first is dropped.
struct CustomMotion {
  Random random{kSeed};
  Mesh mesh = star(3, kSeed), moved_mesh = twisted(mesh, 0.4);
  std::vector<Box> first = random_boxes(random), second = random_boxes(random), moved_second = random_boxes(random),
                   moved_first = random_boxes(random);
  std::vector<build::TriangleMesh> meshes{mesh.view()}, moved_meshes{moved_mesh.view()};
  std::vector<CustomGeometry> customs{{first, 3}, {second, 200, 5}}, moved{{moved_first, 3}, {moved_second, 200}};

  CustomMotion() { first[7].min[1] = moved_first[7].min[1] = std::numeric_limits<float>::quiet_NaN(); }

  SceneInput scene() const { return {meshes, customs}; }
  SceneInput moved_scene() const { return {moved_meshes, moved}; }
};

}  // namespace

TEST_CASE("refits of custom primitives beside meshes") {
  const CustomMotion motion;
  INFO("seed " << kSeed);
  for (const NodeLayout layout : kLayouts) {
    CAPTURE(static_cast<std::uint32_t>(layout));
    File file = built(motion.scene(), {.nodes = layout});
    const std::string before = file.copy();
    refitted(file, motion.scene());
    CHECK((file.copy() == before));
    refitted(file, motion.moved_scene());
    const BufferView view = file.view();
    test::check_tight_boxes(view);
    CHECK(view.geometries[2].mask == 5);
    unsigned wrong = 0;
    for (std::size_t i = 0; i < 2 * kCustoms; ++i) {
      const std::uint32_t at = view.primitive_map[motion.mesh.triangles.size() + i];
      if (i == 7) {
        CHECK(at == kInvalidId);
        continue;
      }
      const Box& there = view.records<CustomLeaf>(view.leaves)[at / 2].box[at % 2];
      const Box& wanted = i < kCustoms ? motion.moved_first[i] : motion.moved_second[i - kCustoms];
      wrong += format_detail::first_different_plane(there, wanted) == format_detail::kNoPlane ? 0 : 1;
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("refits refuse custom primitives that do not match the file") {
  CustomMotion motion;
  INFO("seed " << kSeed);
  const std::vector<Box>&first = motion.first, &second = motion.second, &moved_first = motion.moved_first;
  for (const NodeLayout layout : kLayouts) {
    CAPTURE(static_cast<std::uint32_t>(layout));
    File file = built(motion.scene(), {.nodes = layout});
    refitted(file, motion.moved_scene());
    const auto message = [&](std::vector<CustomGeometry> geometries) {
      return refusal(file, SceneInput{motion.moved_meshes, geometries}).message;
    };
    std::vector<Box> bad = moved_first;
    std::swap(bad[9].min[2], bad[9].max[2]);
    CHECK_THAT(message({{bad, 3, 1, "hair"}, {second, 200}}),
               Contains("custom geometry 0 (hair), primitive 9: ") && Contains("inverted"));
    bad[9].min[2] = -std::numeric_limits<float>::infinity();
    CHECK_THAT(message({{bad, 3}, {second, 200}}), Contains("primitive 9: ") && Contains("not finite"));
    const std::vector<Box> others = random_boxes(motion.random);
    CHECK_THAT(message({{others, 3}, {second, 200}}), Contains("primitive 7: ") && Contains("needs a new build"));
    CHECK_THAT(message({{moved_first, 3}, {second, 201}}),
               Contains("custom geometry 1: type 201") && Contains("type 200"));
    CHECK_THAT(message({{std::span(moved_first).first(kCustoms - 1), 3}, {second, 200}}),
               Contains("299 primitives") && Contains("300"));
    CHECK_THAT(message({{moved_first, 3}}), Contains("2 geometries") && Contains("has 3"));
    const std::vector<CustomGeometry> all{{first, 3}, {first, 3}, {second, 200}};
    CHECK_THAT(refusal(file, SceneInput{{}, all}).message,
               Contains("custom geometry 0: geometry 0 of the file") && Contains("a mesh"));
  }
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

TEST_CASE("progress rises to the end; a cancelled refit leaves a complete file") {
  const Mesh mesh = star(6, kSeed), moved = twisted(mesh, 0.25);
  const std::vector meshes{moved.view()};
  const SceneInput scene{meshes, {}};
  ProgressWatch watch;
  File file = built(mesh);
  const std::string before = file.copy();
  refitted(file, moved, {.threads = 1, .progress = watch.callback()});
  CHECK(watch.steps() == std::set<std::string>{"check", "refit", "checksum"});
  const std::string after = file.copy();
  for (const std::string& stop : watch.steps()) {
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
