// Limits of depth: binary trees reach kMaxDepth and do not pass it, wide trees reach kWideStackNeed entries and then
// grow by one entry per level.

#include <hiprt_build/collapse/collapse_plan.h>
#include <hiprt_build/sah_sbvh/sah.h>
#include <hiprt_build/sah_sbvh/sbvh.h>
#include <hiprt_build/tree/flatten.h>
#include <tests/build/machine.h>

#include <tests/catch.h>

#include <bit>

using namespace hiprt;
using namespace hiprt::build;

namespace {

unsigned depth(const DepthFirstTree& tree, std::uint32_t node) {
  if (tree.nodes[node].count == 1) return 0;
  return 1 + std::max(depth(tree, tree.left(node)), depth(tree, tree.right(node)));
}

/// Sticks of length 1 at growing distances. The farthest of n sticks is @p share * n times as far as the next one, so
/// that the cheapest split takes it alone.
unsigned depth_of_chain(std::uint32_t count, double share) {
  Machine machine;
  auto references = machine.engine.allocate<Reference>(count);
  double at = 0x1p-125;
  for (std::uint32_t i = 0; i < count && at < 0x1p125; ++i) {
    const auto x = static_cast<float>(at);
    references[i] = Reference{};
    references[i].box = Box{{x, 0, 0}, {x, 0, 1}};
    at *= std::max(2.0, share * (i + 2));
  }
  return at < 0x1p125 ? depth(build_sah(machine.engine, std::move(references)), 0) : 0;
}

/// A linked tree with one leaf and the rest at each node. Leaf i of the order from left to right is a point at i.
struct LinkedChain {
  enum class Side { kLeft, kRight, kBoth };  ///< Where the single leaves are.

  std::vector<Reference> leaves;
  std::vector<LinkedNode> nodes;
  std::vector<std::uint32_t> counts;

  LinkedChain(std::uint32_t count, Side side) : leaves(count), nodes(count), counts(count) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto x = static_cast<float>(i);
      leaves[i] = Reference{Box{{x, 0, 0}, {x, 0, 0}}, LeafContents::make(0, 0, 0), i};
    }
    std::uint32_t first = 0, last = count - 1;
    for (std::uint32_t node = 1; node < count; ++node) {
      counts[node] = last - first + 1;
      nodes[node].box = unite(leaves[first].box, leaves[last].box);
      const bool left = side == Side::kLeft || (side == Side::kBoth && node % 2 == 0);
      const LinkedRef single = (left ? first : last) | kLinkedLeaf;
      (left ? ++first : --last);
      const LinkedRef rest = node + 1 == count ? first | kLinkedLeaf : node + 1;
      nodes[node].child[0] = left ? single : rest;
      nodes[node].child[1] = left ? rest : single;
    }
  }
  LinkedTreeView view() const { return {leaves, nodes, counts, leaves.size() == 1 ? kLinkedLeaf : 1u}; }
};

/// Levels of a chain whose end is halved where the halves reach kMaxDepth.
unsigned depth_of_flat_chain(std::uint32_t count) {
  for (unsigned level = 0; level + 1 < count; ++level) {
    const std::uint32_t rest = count - level;
    if (level + std::bit_width(rest) == kMaxDepth) return level + static_cast<unsigned>(std::bit_width(rest - 1));
  }
  return count - 1;
}

/// Checks that a subtree's boxes are those of its references, exactly.
Box check_boxes(const DepthFirstTree& tree, std::uint32_t node) {
  const DepthFirstNode& here = tree.nodes[node];
  const Box box = here.count == 1 ? tree.references[here.first].box
                                  : unite(check_boxes(tree, tree.left(node)), check_boxes(tree, tree.right(node)));
  REQUIRE(same(here.box, box));
  return box;
}

/// Four sticks at the end of a chain of others: 0 and 2 in one place, 1 and 3 beside it, in this order along x.
ScratchArray<Reference> sticks_before_four(CpuEngine& engine, std::uint32_t others, double share) {
  auto references = engine.allocate<Reference>(others + 4);
  const auto put = [&](std::uint32_t i, double x, double y) {
    const auto at = static_cast<float>(x), beside = static_cast<float>(y);
    references[i] = Reference{Box{{at, beside, 0}, {at, beside, 1}}, LeafContents::make(0, 0, 0), i};
  };
  for (std::uint32_t i = 0; i < 4; ++i) put(i, (i + 1) * 0x1p-125, i % 2 == 0 ? 0.0 : 0x1p-118);
  double at = 0x1p-116;
  for (std::uint32_t i = 0; i < others; ++i) {
    put(4 + i, at, 0.0);
    at *= std::max(2.0, share * (i + 6));
  }
  REQUIRE(at < 0x1p127);
  return references;
}

}  // namespace

TEST_CASE("top-down trees reach the greatest depth and do not pass it", "[depth]") {
  unsigned deepest = 0;
  for (std::uint32_t count = 40; count < 120; ++count)
    for (const double share : {0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5}) {
      CAPTURE(count, share);
      const unsigned levels = depth_of_chain(count, share);
      CHECK(levels <= kMaxDepth);
      deepest = std::max(deepest, levels);
    }
  CHECK(deepest == kMaxDepth);
}

TEST_CASE("flattened chains are halved where they would pass the greatest depth, in the order of their leaves",
          "[depth]") {
  unsigned deepest = 0;
  for (std::uint32_t count = 1; count < 200; ++count)
    for (const auto side : {LinkedChain::Side::kLeft, LinkedChain::Side::kRight, LinkedChain::Side::kBoth}) {
      CAPTURE(count, static_cast<int>(side));
      Machine machine;
      const LinkedChain chain(count, side);
      const DepthFirstTree tree = flatten(machine.engine, chain.view());
      REQUIRE(depth(tree, 0) == depth_of_flat_chain(count));
      REQUIRE(depth(tree, 0) <= kMaxDepth);
      deepest = std::max(deepest, depth(tree, 0));
      for (std::uint32_t i = 0; i < count; ++i) REQUIRE(tree.references[i].primitive == i);
      check_boxes(tree, 0);
    }
  CHECK(deepest == kMaxDepth);
}

TEST_CASE("trees with spatial splits halve by count from the level where halves reach the greatest depth", "[depth]") {
  // Four references have three bits. So the rule holds for them at level 57, and not above.
  constexpr unsigned kOthers = kMaxDepth - 3;
  for (const unsigned others : {kOthers - 1, kOthers}) {
    CAPTURE(others);
    Machine machine;
    const GeometryTable none{};
    const auto tree =
        build_sbvh(machine.engine, none, sticks_before_four(machine.engine, others, 0.65), 1.0, {1.0f, 0.0f});
    std::uint32_t node = 0;
    for (unsigned level = 0; level < others; ++level) {
      CAPTURE(level);
      REQUIRE(tree.nodes[node].count == others + 4 - level);
      REQUIRE(tree.nodes[tree.right(node)].count == 1);
      node = tree.left(node);
    }
    REQUIRE(tree.nodes[node].count == 4);
    REQUIRE(tree.nodes[tree.left(node)].count == 2);
    const std::uint32_t first = tree.nodes[node].first;
    REQUIRE(tree.references[first].primitive == 0);
    // The split by cost joins what lies in one place. Halving by count keeps the order along x.
    REQUIRE(tree.references[first + 1].primitive == (others == kOthers ? 1 : 2));
  }
}

TEST_CASE("wide trees add three stack entries per level up to the limit, and then one", "[depth]") {
  const CollapseCosts costs{1.0f, 1.0f, 1.0f, 2};
  // Three large leaves beside the rest: the cheapest wide node shows all three and goes one level down.
  const CollapsePlan leaf = plan_leaf(1e6f, 2, false, costs);
  const CollapsePlan two = plan_inner(leaf, leaf, 2e6f, costs), three = plan_inner(two, leaf, 3e6f, costs);
  CollapsePlan chain = plan_leaf(1.0f, 2, false, costs);
  for (unsigned level = 1; level <= kMaxDepth; ++level) {
    CAPTURE(level);
    chain = plan_inner(three, chain, 4e6f, costs);
    // The three leaves as two children would need three entries, and both forms have one count.
    const unsigned wide = kWideStackNeed / 3 - 1;
    REQUIRE(chain.need == (level <= wide ? 3 * (level + 1) : kWideStackNeed + level - wide));
    REQUIRE((chain.narrow != 0) == (level > wide));
    REQUIRE(chain.need <= kMaxStackBound);
  }
}

TEST_CASE("the limit of wide nodes follows from the depths of trees", "[depth]") {
  // A tree of Morton codes has 95 levels, other trees kMaxDepth. Each level that needs three entries counts towards
  // the limit; the others need one.
  const auto most = [](unsigned levels) { return kWideStackNeed + (levels - kWideStackNeed / 3); };
  CHECK(kWideStackNeed % 3 == 0);
  CHECK(kWideStackNeed / 3 == 40);
  CHECK(most(95) == 175);
  CHECK(most(95) <= kMaxStackBound);
  CHECK(most(kMaxDepth) <= kMaxStackBound);
  // CollapsePlan::need has eight bits, and 255 says "or more".
  CHECK(most(95) < 255);
}
