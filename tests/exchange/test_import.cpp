// Imported trees give the hits of brute force. Export and import keep the cost of a tree.

#include "trees.h"

#include <hiprt_build/format/validate.h>
#include <hiprt_build/statistics.h>
#include <tests/build/progress_watch.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/every_hit.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/workers.h>

#include <algorithm>

using namespace hiprt;
using namespace hiprt::checks;
using namespace hiprt::test;
using build::Builder;
using build::BuildOptions;
using build::SceneInput;

namespace {

constexpr std::uint64_t kSeed = 4242;
constexpr NodeLayout kLayouts[] = {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized};

build::Bvh imported(const SceneInput& scene, const ExchangeBvh& tree, const BuildOptions& options = {}) {
  auto bvh = build::import_tree(scene, tree, options);
  INFO((bvh ? "" : bvh.error().message));
  REQUIRE(bvh.has_value());
  CHECK(bvh->statistics.builder == Builder::kImported);
  const auto valid = hiprt::validate(bvh->buffer.bytes());
  INFO((valid ? "" : to_string(valid.error())));
  REQUIRE(valid);
  CHECK(valid->leaf_triangles + valid->leaf_customs + valid->dropped >= valid->primitives);
  return std::move(*bvh);
}

BufferView view_of(const build::Bvh& bvh) {
  const auto view = open_buffer(bvh.buffer.bytes());
  REQUIRE(view.has_value());
  return *view;
}

/// Closest hits of 300 rays, bit for bit.
void check_hits(const std::vector<Mesh>& meshes, const build::Bvh& bvh) {
  INFO("seed " << kSeed);
  const SceneView scene = make_scene_view(view_of(bvh));
  Random random(kSeed);
  unsigned found = 0;
  const unsigned rays = std::max(60u, trials(300));
  for (unsigned i = 0; i < rays; ++i) {
    const Ray ray{vec3(random.in_cube(1.5)), 0.0f, vec3(random.in_cube(1))};
    const auto all = every_hit(meshes, ray);
    const Hit expected = all.empty() ? Hit{} : all[0], hit = closest_hit(scene, ray);
    INFO("ray " << i << "\n" << describe(ray) << "\n" << describe(hit) << "\n" << describe(expected));
    REQUIRE(same_hit(hit, expected));
    found += hit.found() ? 1 : 0;
  }
  if (!meshes.empty() && meshes[0].triangles.size() > 100) CHECK(found > rays / 10);
}

ExchangeBvh exported(const build::Bvh& bvh) {
  auto tree = build::export_tree(view_of(bvh));
  INFO((tree ? "" : tree.error().message));
  REQUIRE(tree.has_value());
  return std::move(*tree);
}

double cost_of(const build::Bvh& bvh) { return build::measure_tree(view_of(bvh)).sah_cost; }

/// The surface area cost of a tree without changes, with one primitive per leaf record.
double cost_of(const ExchangeBvh& tree) {
  const auto area = [](const Box& box) {
    const double x = box.max[0] - box.min[0], y = box.max[1] - box.min[1], z = box.max[2] - box.min[2];
    return x * y + y * z + z * x;
  };
  double sum = 0;
  for (const ExchangeNode& node : tree.nodes)
    sum += area(node.box) * (node.children != 0 ? 1.0 : 0.8 * node.primitives);
  return sum / area(tree.nodes[0].box);
}

}  // namespace

TEST_CASE("random trees of every shape, in every layout, trace as brute force does") {
  const std::vector<Mesh> meshes{soup(400, 0.4, kSeed), icosphere(2), torture(200, kSeed)};
  const auto views = oracle::views(meshes);
  const std::vector<Box> boxes = primitive_boxes(meshes);
  for (const TreeShape& shape : {TreeShape{2, 1}, TreeShape{2, 5}, TreeShape{3, 2}, TreeShape{4, 1}, TreeShape{4, 100}})
    for (const unsigned rounds : {0u, 2u}) {
      CAPTURE(shape.branching, shape.leaf, rounds);
      const ExchangeBvh tree = random_tree(boxes, shape, kSeed);
      check_hits(meshes, imported({.meshes = views}, tree, {.reinsertion_rounds = rounds}));
      check_hits(meshes, imported({.meshes = views}, tree,
                                  {.reinsertion_rounds = rounds, .max_leaf_triangles = 1, .pair_triangles = false}));
    }
  const std::vector<Mesh> common{meshes[0], meshes[1]};
  const auto common_views = oracle::views(common);
  const ExchangeBvh tree = random_tree(primitive_boxes(common), {4, 3}, kSeed);
  for (const NodeLayout layout : kLayouts) {
    CAPTURE(static_cast<std::uint32_t>(layout));
    check_hits(common, imported({.meshes = common_views}, tree, {.nodes = layout}));
  }
}

TEST_CASE("one, two and three triangles") {
  for (const unsigned count : {1u, 2u, 3u}) {
    const std::vector<Mesh> meshes{soup(count, 1.0, kSeed)};
    const auto views = oracle::views(meshes);
    const std::vector<Box> boxes = primitive_boxes(meshes);
    for (const TreeShape& shape : {TreeShape{2, 1}, TreeShape{2, 2}, TreeShape{4, 3}}) {
      CAPTURE(count, shape.leaf);
      const build::Bvh bvh = imported({.meshes = views}, random_tree(boxes, shape, kSeed));
      CHECK(bvh.statistics.leaves == count);
      check_hits(meshes, bvh);
      const ExchangeBvh tree = exported(bvh);
      CHECK(build::validate(tree, {.meshes = views}).has_value());
      CHECK(tree.primitives.size() == count);
    }
  }
}

TEST_CASE("triangles share a leaf only if the tree has them in one leaf, and then whenever they can") {
  // A strip of quads: triangles 2 i and 2 i + 1 are quad i.
  const std::vector<Mesh> meshes{grid_plane(8, 2, 0)};
  const auto views = oracle::views(meshes);
  const SceneInput scene{.meshes = views};
  const std::vector<Box> boxes = primitive_boxes(meshes);
  const auto pairs = [&](const ExchangeBvh& tree) { return imported(scene, tree).statistics.pairs; };
  CHECK(pairs(random_tree(boxes, {2, 1}, kSeed)) == 0);
  CHECK(pairs(random_tree(boxes, {2, 1000}, kSeed)) == 64);
  // Every leaf has a triangle of a quad and one of the next quad but one.
  std::vector<Box> apart(boxes.size() / 2);
  ExchangeBvh tree = random_tree(apart, {2, 1}, kSeed);
  for (ExchangeNode& node : tree.nodes) {
    node.box = box_over(Box{{-1, -1, 0}, {1, 1, 0}}, Box{{-1, -1, 0}, {1, 1, 0}});
    node.first *= node.children == 0 ? 2 : 1;
    node.primitives *= 2;
  }
  tree.primitives.resize(boxes.size());
  for (std::uint32_t i = 0; i < boxes.size(); ++i) tree.primitives[i] = i;
  CHECK(pairs(tree) == 64);
  for (std::uint32_t i = 0; i < boxes.size(); ++i) tree.primitives[i] = i % 2 == 0 ? i : (i + 4) % 128;
  CHECK(pairs(tree) == 0);
}

TEST_CASE("a leaf with many primitives becomes a tree as good as our own") {
  const std::vector<Mesh> meshes{star(6, 1)};  // 81,920 triangles: split by more than one thread.
  const auto views = oracle::views(meshes);
  const ExchangeBvh tree = random_tree(primitive_boxes(meshes), {2, 100000}, kSeed);
  REQUIRE(tree.nodes.size() == 1);
  const auto ours = build::build(views, {.builder = Builder::kSah});
  REQUIRE(ours.has_value());
  CHECK(cost_of(imported({.meshes = views}, tree)) == Approx(cost_of(*ours)).epsilon(1e-6));
}

TEST_CASE("an import does not depend on the number of threads") {
  const std::vector<Mesh> meshes{star(6, 1), soup(20000, 0.1, kSeed)};
  const auto views = oracle::views(meshes);
  for (const unsigned leaf : {3u, 70000u, 200000u}) {
    const ExchangeBvh tree = random_tree(primitive_boxes(meshes), {4, leaf}, kSeed);
    const build::Bvh one = imported({.meshes = views}, tree, {.threads = 1, .reinsertion_rounds = 1}),
                     many = imported({.meshes = views}, tree, {.threads = 4, .reinsertion_rounds = 1});
    REQUIRE(one.buffer.size() == many.buffer.size());
    CHECK(std::equal(one.buffer.bytes().begin(), one.buffer.bytes().end(), many.buffer.bytes().begin()));
  }
}

TEST_CASE("the collapse does not make a tree of four children per node more expensive") {
  // The import of a tree of four children per node, without pairs, must not cost more than the tree itself.
  const std::vector<Mesh> meshes{soup(3000, 0.05, kSeed)};
  const auto views = oracle::views(meshes);
  for (const unsigned branching : {2u, 3u, 4u}) {
    const ExchangeBvh tree = random_tree(primitive_boxes(meshes), {branching, 1}, kSeed + branching);
    const build::Bvh bvh = imported({.meshes = views}, tree, {.pair_triangles = false});
    CAPTURE(branching, cost_of(tree));
    CHECK(cost_of(bvh) <= cost_of(tree) * (1 + 1e-5));
  }
}

TEST_CASE("trees of every builder, exported and imported, cost as much and trace the same") {
  std::printf("%-10s %-14s %9s %9s %6s\n", "mesh", "builder", "before", "after", "ratio");
  const std::pair<const char*, std::vector<Mesh>> scenes[] = {{"star", {star(4, 1)}},
                                                              {"two", {subdivided_box(12, 1.2, 2), soup(500, 0.2, 3)}},
                                                              {"needles", {needles(1500, 30, 4)}}};
  Sample sample(3);
  for (const auto& [name, meshes] : scenes) {
    const auto views = oracle::views(meshes);
    for (const auto& [word, builder] : tools::kBuilders) {
      if (!sample.next()) continue;
      const auto before = build::build(views, {.builder = builder});
      REQUIRE(before.has_value());
      const ExchangeBvh tree = exported(*before);
      const auto good = build::validate(tree, {.meshes = views});
      INFO((good ? "" : good.error().message));
      REQUIRE(good.has_value());
      const build::Bvh after = imported({.meshes = views}, tree);
      const double ratio = cost_of(after) / cost_of(*before);
      std::printf("%-10s %-14s %9.3f %9.3f %6.3f\n", name, std::string(word).c_str(), cost_of(*before), cost_of(after),
                  ratio);
      CAPTURE(word);
      check_hits(meshes, after);
      CHECK(ratio <= 1.01);
    }
  }
}

TEST_CASE("a triangle in many leaves is split between them") {
  // A slanted rectangle of two triangles over a grid of cells: a leaf for each, with another small triangle.
  constexpr std::uint32_t kCells = 40;
  std::vector<Mesh> meshes(1);
  Mesh& mesh = meshes[0];
  mesh.positions = {{0, 0, 0}, {kCells, 0, 1}, {0, kCells, 1}, {kCells, kCells, 2}};
  mesh.triangles = {{0, 1, 2}, {1, 3, 2}};
  std::vector<Box> cells;
  for (std::uint32_t y = 0; y < kCells; ++y)
    for (std::uint32_t x = 0; x < kCells; ++x) {
      const float a = static_cast<float>(x), b = static_cast<float>(y);
      oracle::append(mesh, {a, b, 0}, {a + 1, b, 2}, {a, b + 1, 2});
      cells.push_back({{a, b, 0}, {a + 1, b + 1, 2}});
    }
  ExchangeBvh tree = random_tree(cells, {4, 1}, kSeed);
  for (ExchangeNode& node : tree.nodes)
    if (node.children == 0) node = {node.box, 3 * node.first, 0, 3};
  std::vector<std::uint32_t> entries;
  for (const std::uint32_t cell : tree.primitives) entries.insert(entries.end(), {0, 1, cell + 2});
  tree.primitives = entries;
  const auto views = oracle::views(meshes);
  const build::Bvh bvh = imported({.meshes = views}, tree);
  CHECK(bvh.statistics.pairs == 1);
  CHECK(bvh.statistics.leaves == 2 * kCells * kCells);
  Random random(kSeed);
  for (unsigned i = 0; i < 1000; ++i) {
    const Position from = random.in_cube(50), to = random.in_cube(20);
    const Ray ray{vec3(from), 0.0f, Vec3(to[0] + 20 - from[0], to[1] + 20 - from[1], 1 - from[2])};
    const auto all = every_hit(meshes, ray);
    REQUIRE(same_hit(closest_hit(make_scene_view(view_of(bvh)), ray), all.empty() ? Hit{} : all[0]));
  }
  // Leaves whose boxes are all the same: no plane is between them, and the triangles stay whole.
  for (ExchangeNode& node : tree.nodes) node.box = tree.nodes[0].box;
  CHECK(imported({.meshes = views}, tree).statistics.leaves == kCells * kCells + 1);
}

TEST_CASE("files of every layout are exported with their boxes") {
  const std::vector<Mesh> meshes{oracle::placed(star(4, 1), 1e5)};  // Beyond the range of half.
  const auto views = oracle::views(meshes);
  for (const NodeLayout layout : kLayouts)
    for (const Builder builder : {Builder::kSah, Builder::kSbvh}) {
      CAPTURE(static_cast<std::uint32_t>(layout), build::name(builder));
      const auto bvh = build::build(views, {.builder = builder, .nodes = layout});
      REQUIRE(bvh.has_value());
      const ExchangeBvh tree = exported(*bvh);
      const build::TreeStatistics statistics = build::measure_tree(view_of(*bvh));
      CHECK(tree.nodes.size() == statistics.nodes + statistics.leaf_runs);
      const auto good = build::validate(tree, {.meshes = views});
      INFO((good ? "" : good.error().message));
      CHECK(good.has_value());
      const double ratio = cost_of(imported({.meshes = views}, tree, {.nodes = layout})) / cost_of(*bvh);
      CHECK(ratio <= 1.02);
    }
}

TEST_CASE("custom primitives are exported and imported beside meshes") {
  const std::vector<Mesh> meshes{star(3, 1)};
  Random random(kSeed);
  std::vector<Box> boxes(500);
  for (Box& box : boxes) {
    const Position low = random.in_cube(1);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.min[axis] = low[axis];
      box.max[axis] = low[axis] + random.uniform_float(0, 0.1);
    }
  }
  boxes[7].min[0] = std::numeric_limits<float>::quiet_NaN();
  const std::vector<build::CustomGeometry> customs{{boxes, 3}};
  const auto views = oracle::views(meshes);
  const SceneInput scene{views, customs};
  const auto before = build::build(scene);
  REQUIRE(before.has_value());
  const build::Bvh after = imported(scene, exported(*before));
  CHECK(after.statistics.customs == 500);
  CHECK(cost_of(after) / cost_of(*before) <= 1.005);
  imported(scene, random_tree(primitive_boxes(meshes, boxes), {4, 5}, kSeed));
}

TEST_CASE("empty files are exported as trees without nodes, damaged files are refused") {
  const auto empty = build::build(SceneInput{});
  REQUIRE(empty.has_value());
  CHECK(exported(*empty).nodes.empty());
  auto bvh = build::build(oracle::views({star(2, 1)}));
  REQUIRE(bvh.has_value());
  const BufferView view = view_of(*bvh);
  bvh->buffer.bytes()[view.nodes.offset] ^= std::byte{1};
  const auto refused = build::export_tree(view);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == build::ErrorCode::kInvalidInput);
  CHECK_THAT(refused.error().message, Catch::Contains("BadChecksum"));
  CHECK_FALSE(build::export_tree(BufferView{}).has_value());
}

TEST_CASE("a chain of a million leaves (fewer in slow builds) is balanced where it is too deep") {
  const std::vector<Mesh> meshes{soup(trials(1000000), 1e-3, kSeed)};
  const auto views = oracle::views(meshes);
  const build::Bvh bvh = imported({.meshes = views}, chain_tree(primitive_boxes(meshes)));
  CHECK(build::measure_tree(view_of(bvh)).depth <= 60);
}

TEST_CASE("an import reports progress and can be cancelled in every step") {
  const std::vector<Mesh> meshes{soup(200000, 1e-2, kSeed)};
  const auto views = oracle::views(meshes);
  const ExchangeBvh tree = random_tree(primitive_boxes(meshes), {4, 3}, kSeed);
  ProgressWatch watch;
  imported({.meshes = views}, tree, {.progress = watch.callback()});
  CHECK(watch.last() > 0.9);
  for (const std::string step : {"check", "pair", "split", "join", "order", "collapse", "encode"}) {
    CAPTURE(step);
    CHECK(watch.steps().count(step) == 1);
    const auto stop = [&](const build::Progress& progress) { return progress.step != step; };
    const auto refused = build::import_tree({.meshes = views}, tree, {.progress = stop});
    REQUIRE_FALSE(refused.has_value());
    CHECK(refused.error().code == build::ErrorCode::kCancelled);
  }
}
