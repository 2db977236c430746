// Limits of depth: binary trees reach kMaxDepth and do not pass it, wide trees reach kWideStackNeed entries and then
// grow by one entry per level.

#include <hiprt_build/collapse/collapse_plan.h>
#include <hiprt_build/sah_sbvh/sah.h>
#include <tests/build/machine.h>

#include <tests/catch.h>

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
