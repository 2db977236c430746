/// Statistics of the golden scene, computed by hand. tests/format/golden/make_golden.py describes the scene.

#include <hiprt_build/statistics.h>

#include "../format/test_scene.h"

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::build;
using namespace hiprt::test;

namespace {

NodeLayout any_layout() {
  return GENERATE(NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized);
}

TreeStatistics measure(const TestScene& scene, const SahCosts& costs = {.box_node = 1, .leaf = 1}) {
  const TestFile file = scene.write();
  const auto view = open_buffer(file.bytes());
  REQUIRE(view);
  return measure_tree(*view, costs);
}

}  // namespace

TEST_CASE("statistics of a row of flat squares") {
  const TreeStatistics row = measure(row_scene(any_layout()), {.box_node = 1, .leaf = 10});
  CHECK(row.nodes == 2);
  CHECK(row.leaves == 4);
  CHECK(row.leaf_triangles == 7);
  CHECK(row.leaf_runs == 3);
  CHECK(row.nodes_by_children == std::array<std::uint64_t, 5>{0, 0, 2, 0, 0});
  CHECK(row.depth == 2);
  CHECK(row.fill == Approx(0.5));
  CHECK(row.pair_fill == Approx(7.0 / 8));
  // Half areas (flat in z, so length in x): root 7, node 1 3, run of two leaves 3, leaves 2 and 3 1 each.
  CHECK(row.sah_cost == Approx((7 + 3 + 10 * (2 * 3 + 1 + 1)) / 7.0));
  CHECK(row.sibling_overlap == 0);
}

TEST_CASE("sibling overlap is weighted with the parents' areas") {
  TestScene scene = row_scene(any_layout());
  scene.nodes[0][2].box.min[0] = 1;  // Overlaps the run's box, x 0-3, in x 1-3; half areas: common 2, root 7, node 1 6.
  const TreeStatistics row = measure(scene);
  CHECK(row.sibling_overlap == Approx(2.0 / (7 + 6)));
}

TEST_CASE("statistics of a scene without a box node, and of an empty scene") {
  const NodeLayout layout = any_layout();
  const TreeStatistics leaf = measure(root_leaf_scene(layout), {.box_node = 1, .leaf = 3});
  CHECK(leaf.nodes == 0);
  CHECK(leaf.depth == 0);
  CHECK(leaf.leaf_runs == 1);
  CHECK(leaf.pair_fill == 1);
  CHECK(leaf.fill == 0);
  CHECK(leaf.sah_cost == 3);
  const TreeStatistics empty = measure(empty_scene(layout));
  CHECK(empty.leaves == 0);
  CHECK(empty.leaf_runs == 0);
  CHECK(empty.sah_cost == 0);
}

TEST_CASE("split references count once per leaf") {
  const TreeStatistics split = measure(split_scene(any_layout()));
  CHECK(split.leaf_triangles == 2);
  CHECK(split.leaves == 2);
  CHECK(split.pair_fill == 0.5);
  CHECK(split.sah_cost == Approx((16 + 8 + 4) / 16.0));
}

TEST_CASE("a scene on one line has a finite cost") {
  TestScene scene = root_leaf_scene(any_layout());
  for (auto& vertex : scene.leaves[0].vertex) vertex[1] = 0;
  scene.root.box.max[1] = 0;
  CHECK(measure(scene).sah_cost == 1);
}

TEST_CASE("statistics of triangles beside custom primitives") {
  const TreeStatistics mixed = measure(custom_scene(any_layout()), {.box_node = 1, .leaf = 10, .custom = 100});
  CHECK(mixed.leaves == 4);
  CHECK(mixed.custom_leaves == 3);
  CHECK(mixed.leaf_triangles == 2);
  CHECK(mixed.leaf_customs == 5);
  CHECK(mixed.leaf_runs == 3);
  CHECK(mixed.pair_fill == Approx(7.0 / 8));
  // Half areas: root 7 x 1.5 x 1, node 1 3.5 x 1.5 x 1, square 1 x 1 x 0, near 1.5 x 1.5 x 1, far (two leaves) 3 x 1
  // x 1.
  const double root = 7 * 1.5 + 7 + 1.5, node = 3.5 * 1.5 + 3.5 + 1.5, near = 1.5 * 1.5 + 1.5 + 1.5, far = 3 + 3 + 1;
  CHECK(mixed.sah_cost == Approx((root + node + 10 * 1 + 100 * (near + 2 * far)) / root));
  const TreeStatistics alone = measure(custom_root_scene(any_layout()), {.custom = 7});
  CHECK(alone.sah_cost == 7);
  CHECK(alone.leaf_customs == 1);
}

TEST_CASE("infinite half planes count as the scene's bounds") {
  // Flat in z: lengths in x plus areas in x and y. Children from -1e6 to -65504 and from 65504 to 1e30, both of
  // height 1.
  const TreeStatistics far = measure(far_scene());
  const double root = 1e30 + 1e6, left = 1e6 - 65504, right = 1e30;
  CHECK(far.sah_cost == Approx((root + left + right) / root));
  CHECK(far.sibling_overlap == 0);
}
