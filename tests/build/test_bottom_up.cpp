// Bottom-up trees over Morton codes: each step against a slow implementation of the same definition.

#include <hiprt_build/exec/lane_group.h>
#include <hiprt_build/lbvh_ploc/bottom_up.h>
#include <hiprt_build/lbvh_ploc/hploc.h>
#include <hiprt_build/lbvh_ploc/lbvh.h>
#include <hiprt_build/lbvh_ploc/morton.h>
#include <hiprt_build/lbvh_ploc/ploc_steps.h>
#include <tests/build/machine.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/catch.h>

#include <map>
#include <numeric>

using namespace hiprt;
using namespace hiprt::oracle;
using namespace hiprt::build;

namespace {

/// A tree that a test has the boxes of.
struct Forest {
  explicit Forest(std::vector<Box> leaf_boxes)
      : boxes(std::move(leaf_boxes)), nodes(boxes.size()), counts(boxes.size()), met(boxes.size(), kInvalidId) {}
  std::vector<Box> boxes;
  std::vector<LinkedNode> nodes;
  std::vector<std::uint32_t> counts, met;
  LinkedRef root = kInvalidId;
  LinkedTree<BoxLeaves> tree() { return {{boxes.data()}, nodes.data(), {counts.data()}, &root}; }

  /// Checks the nodes below @p ref. @return its leaves, from left to right.
  std::vector<std::uint32_t> leaves(LinkedRef ref) const {
    if ((ref & kLinkedLeaf) != 0) return {ref & ~kLinkedLeaf};
    const LinkedNode& node = nodes.at(ref);
    std::vector<std::uint32_t> all = leaves(node.child[0]);
    for (const std::uint32_t leaf : leaves(node.child[1])) all.push_back(leaf);
    CHECK(counts.at(ref) == all.size());
    Box box = empty_box();
    for (const std::uint32_t leaf : all) grow(box, boxes[leaf]);
    CHECK(same(box, node.box));
    return all;
  }
  /// Every leaf once, every box that of its leaves.
  void check() const {
    std::vector<std::uint32_t> all = leaves(root);
    std::sort(all.begin(), all.end());
    std::vector<std::uint32_t> wanted(boxes.size());
    std::iota(wanted.begin(), wanted.end(), 0u);
    REQUIRE(all == wanted);
  }
};

std::vector<std::uint8_t> levels_of(const std::vector<std::uint64_t>& codes) {
  std::vector<std::uint8_t> levels(codes.size());
  for (std::size_t i = 0; i + 1 < codes.size(); ++i)
    levels[i] = boundary_level(codes[i], codes[i + 1], static_cast<std::uint32_t>(i));
  return levels;
}

/// The last index of a range's left part, by definition: a range is split where the highest bit changes that its codes
/// do not share. When all codes are equal, the indices take their place.
std::uint32_t last_of_left(const std::vector<std::uint64_t>& codes, std::uint32_t first, std::uint32_t last) {
  const bool same = codes[first] == codes[last];
  const auto number = [&](std::uint32_t i) { return same ? i : codes[i]; };
  std::uint64_t bit = std::uint64_t{1} << 63;
  while ((number(first) & bit) == (number(last) & bit)) bit >>= 1;
  std::uint32_t at = first;
  while ((number(at + 1) & bit) == 0) ++at;
  return at;
}

void check_splits(const Forest& forest, const std::vector<std::uint64_t>& codes, LinkedRef ref, std::uint32_t first,
                  std::uint32_t last) {
  if (first == last) {
    REQUIRE(ref == (first | kLinkedLeaf));
    return;
  }
  const std::uint32_t at = last_of_left(codes, first, last);
  REQUIRE(ref == at + 1);
  check_splits(forest, codes, forest.nodes[ref].child[0], first, at);
  check_splits(forest, codes, forest.nodes[ref].child[1], at + 1, last);
}

/// Sorted codes, many of them equal.
std::vector<std::uint64_t> random_codes(Random& random, std::uint32_t count) {
  std::vector<std::uint64_t> codes;
  const std::uint32_t range = 1 + random.below(2 * count);
  const unsigned shift = random.below(32);
  for (std::uint32_t i = 0; i < count; ++i) codes.push_back(std::uint64_t{random.below(range)} << shift);
  std::sort(codes.begin(), codes.end());
  return codes;
}

using Climber = Hploc<HostGroup, LinkedTree<BoxLeaves>>;

void run_hploc(Forest& forest, const std::vector<std::uint64_t>& codes, const std::vector<std::uint32_t>& order) {
  const auto count = static_cast<std::uint32_t>(codes.size());
  const std::vector<std::uint8_t> levels = levels_of(codes);
  std::vector<KeptCluster> kept(count);
  const Climber climber{forest.tree(), count, levels.data(), forest.met.data(), kept.data(), 8};
  for (const std::uint32_t i : order) {
    Climber::Shared shared;
    climber(HostGroup{}, shared, i);
  }
}

DepthFirstTree built(Machine& machine, Builder builder, const std::vector<Box>& boxes, unsigned radius = 8) {
  auto references = machine.engine.allocate<Reference>(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i)
    references[i] = Reference{boxes[i], LeafContents::make(0, 0, 0), static_cast<std::uint32_t>(i)};
  return build_bottom_up(machine.engine, builder, std::move(references), radius);
}

unsigned depth(const DepthFirstTree& tree, std::uint32_t node) {
  return tree.nodes[node].count == 1 ? 0 : 1 + std::max(depth(tree, tree.left(node)), depth(tree, tree.right(node)));
}

/// Sets of leaves below the nodes.
using Subsets = std::multiset<std::vector<std::uint32_t>>;

void add_subsets(const DepthFirstTree& tree, std::uint32_t node, Subsets& subsets) {
  const DepthFirstNode& n = tree.nodes[node];
  std::vector<std::uint32_t> below;
  for (std::uint32_t i = 0; i < n.count; ++i) below.push_back(tree.references[n.first + i].primitive);
  std::sort(below.begin(), below.end());
  subsets.insert(below);
  if (n.count == 1) return;
  add_subsets(tree, tree.left(node), subsets);
  add_subsets(tree, tree.right(node), subsets);
}

struct SlowCluster {
  Box box;
  std::uint64_t code;
  std::vector<std::uint32_t> leaves;
};

/// One cluster per box, in the order of the Morton codes.
std::vector<SlowCluster> sorted_clusters(const std::vector<Box>& boxes) {
  Box centers = empty_box();
  for (const Box& box : boxes) {
    Box center;
    for (unsigned axis = 0; axis < 3; ++axis) center.min[axis] = center.max[axis] = split_position(box, axis);
    grow(centers, center);
  }
  std::vector<SlowCluster> clusters;
  for (std::uint32_t i = 0; i < boxes.size(); ++i)
    clusters.push_back({boxes[i], MortonGrid::over(centers, kMortonBits63).code(boxes[i]), {i}});
  std::stable_sort(clusters.begin(), clusters.end(),
                   [](const SlowCluster& a, const SlowCluster& b) { return a.code < b.code; });
  return clusters;
}

/// The cluster at most @p radius positions away whose common box with cluster @p i has the smallest area.
int nearest_cluster(const std::vector<SlowCluster>& clusters, int i, int radius) {
  const int count = static_cast<int>(clusters.size());
  const auto area = [&](int k) { return half_area(unite(clusters[std::size_t(i)].box, clusters[std::size_t(k)].box)); };
  int best = -1;
  for (int j = std::max(0, i - radius); j < count && j <= i + radius; ++j) {
    if (j == i) continue;
    if (best < 0 || area(j) < area(best) || (area(j) == area(best) && (i ^ j) < (i ^ best))) best = j;
  }
  return best;
}

/// One round: joins clusters that are each other's nearest, and adds their sets of leaves to @p subsets.
std::vector<SlowCluster> join_mutually_nearest(const std::vector<SlowCluster>& clusters, int radius, Subsets& subsets) {
  const int count = static_cast<int>(clusters.size());
  std::vector<int> nearest;
  nearest.reserve(clusters.size());
  for (int i = 0; i < count; ++i) nearest.push_back(nearest_cluster(clusters, i, radius));
  std::vector<SlowCluster> next;
  for (int i = 0; i < count; ++i) {
    const int j = nearest[std::size_t(i)];
    SlowCluster cluster = clusters[std::size_t(i)];
    if (nearest[std::size_t(j)] == i) {
      if (j < i) continue;
      const SlowCluster& other = clusters[std::size_t(j)];
      grow(cluster.box, other.box);
      cluster.leaves.insert(cluster.leaves.end(), other.leaves.begin(), other.leaves.end());
      std::sort(cluster.leaves.begin(), cluster.leaves.end());
      subsets.insert(cluster.leaves);
    }
    next.push_back(cluster);
  }
  return next;
}

/// Locally-ordered clustering by its definition. (With so few boxes every round joins at least one cluster in
/// kPlocMinJoined, so no round joins neighbours instead.)
Subsets slow_ploc(const std::vector<Box>& boxes, unsigned radius) {
  Subsets subsets;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) subsets.insert({i});
  std::vector<SlowCluster> clusters = sorted_clusters(boxes);
  while (clusters.size() > 1) clusters = join_mutually_nearest(clusters, static_cast<int>(radius), subsets);
  return subsets;
}

}  // namespace

TEST_CASE("LBVH makes the tree that the codes define, in any order of the leaves") {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  INFO("seed " << kSeed);
  for (int round = 0; round < 300; ++round) {
    const std::uint32_t count = 1 + random.below(200);
    const std::vector<std::uint64_t> codes = random_codes(random, count);
    std::vector<Box> boxes;
    for (std::uint32_t i = 0; i < count; ++i) boxes.push_back(random_box(random));
    Forest forest(boxes);
    const std::vector<std::uint8_t> levels = levels_of(codes);
    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0u);
    for (std::uint32_t i = count; i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
    const LbvhStep<LinkedTree<BoxLeaves>> step{forest.tree(), count, levels.data(), forest.met.data()};
    for (const std::uint32_t i : order) step(i);
    CAPTURE(round, count);
    forest.check();
    check_splits(forest, codes, forest.root, 0, count - 1);
  }
}

TEST_CASE("H-PLOC makes a complete tree, the same in any order of the leaves") {
  constexpr std::uint64_t kSeed = 4;
  Random random(kSeed);
  INFO("seed " << kSeed);
  for (int round = 0; round < 200; ++round) {
    const std::uint32_t count = 1 + random.below(round % 2 == 0 ? 40 : 400);
    const std::vector<std::uint64_t> codes = random_codes(random, count);
    std::vector<Box> boxes;
    const Box one = random_box(random);
    for (std::uint32_t i = 0; i < count; ++i) boxes.push_back(round % 3 == 0 ? one : random_box(random));
    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0u);
    Forest first(boxes), second(boxes);
    run_hploc(first, codes, order);
    for (std::uint32_t i = count; i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
    run_hploc(second, codes, order);
    CAPTURE(round, count);
    first.check();
    REQUIRE(first.root == second.root);
    REQUIRE((first.counts == second.counts));
    for (std::uint32_t i = 1; i < count; ++i) {
      const LinkedNode &a = first.nodes[i], &b = second.nodes[i];
      REQUIRE((same(a.box, b.box) && a.child[0] == b.child[0] && a.child[1] == b.child[1]));
    }
  }
}

TEST_CASE("H-PLOC joins two distant pairs before it joins neighbours on the curve") {
  // Along the curve: near 0, near 9, near 0, near 9. The hierarchy of codes would join neighbours.
  const std::vector<Box> boxes{box_at({0, 0, 0}, {1, 1, 1}), box_at({9, 0, 0}, {1, 1, 1}), box_at({0, 1, 0}, {1, 1, 1}),
                               box_at({9, 1, 0}, {1, 1, 1})};
  Forest forest(boxes);
  run_hploc(forest, {0, 1, 2, 3}, {0, 1, 2, 3});
  forest.check();
  std::set<std::vector<std::uint32_t>> pairs;
  for (const LinkedRef child : forest.nodes[forest.root].child) {
    std::vector<std::uint32_t> below = forest.leaves(child);
    std::sort(below.begin(), below.end());
    pairs.insert(below);
  }
  CHECK(pairs == std::set<std::vector<std::uint32_t>>{{0, 2}, {1, 3}});
}

TEST_CASE("equal boxes and areas that overflow give balanced trees") {
  constexpr float kMost = std::numeric_limits<float>::max();
  for (const Box& box : {box_at({1, 2, 3}, {1, 1, 1}), box_at({0, 0, 0}, {0, 0, 0}),
                         Box{{-kMost, -kMost, -kMost}, {kMost, kMost, kMost}}, Box{{-kMost, 0, 0}, {kMost, 0, 0}}})
    for (const Builder builder : {Builder::kLbvh, Builder::kLbvh30, Builder::kPloc, Builder::kHploc})
      for (const std::size_t count : {1u, 2u, 3u, 31u, 32u, 33u, 1000u, 1024u, 10000u}) {
        Machine machine;
        const DepthFirstTree tree = built(machine, builder, std::vector<Box>(count, box));
        CAPTURE(static_cast<int>(builder), count, box.max[0]);
        REQUIRE(tree.references.size() == count);
        CHECK(depth(tree, 0) <= static_cast<unsigned>(std::bit_width(count - 1)) + 4);
      }
}

TEST_CASE("PLOC joins the clusters of its definition") {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  INFO("seed " << kSeed);
  for (int round = 0; round < 60; ++round) {
    std::vector<Box> boxes;
    const std::uint32_t count = 1 + random.below(150);
    for (std::uint32_t i = 0; i < count; ++i) boxes.push_back(random_box(random));
    const unsigned radius = 1 + random.below(20);
    Machine machine;
    const DepthFirstTree tree = built(machine, Builder::kPloc, boxes, radius);
    Subsets subsets;
    add_subsets(tree, 0, subsets);
    CAPTURE(round, count, radius);
    REQUIRE((subsets == slow_ploc(boxes, radius)));
  }
}

TEST_CASE("PLOC: a row of boxes, each nearest to the previous one, does not take a round per box") {
  std::vector<Box> boxes;
  float at = 0;
  for (int i = 0; i < 200000; ++i) {
    boxes.push_back(box_at({at, 0, 0}, {1, 1, 1}));
    at += 2.0f + 1e-3f * static_cast<float>(i);
  }
  for (const Builder builder : {Builder::kPloc, Builder::kHploc}) {
    Machine machine;
    const DepthFirstTree tree = built(machine, builder, boxes);
    CHECK(tree.references.size() == boxes.size());
    CHECK(depth(tree, 0) <= kMaxDepth);
  }
}

TEST_CASE("PLOC bounds its rounds, also when each round joins only one pair") {
  for (const std::uint32_t count : {2u, 3u, 1000u, 1u << 20, (1u << 26) + 1})
    for (const std::uint32_t share : {2u, 3u, kPlocMinJoined - 1, kPlocMinJoined, kPlocMinJoined + 1, count}) {
      PlocProgress progress = PlocProgress::start(count);
      while (progress.count > 1) {
        const std::uint32_t n = progress.count;
        progress = progress.next(n - (progress.neighbours != 0 ? n / 2 : std::max(1u, n / share)));
        REQUIRE(progress.looks <= kPlocMostLooks);
        REQUIRE(progress.rounds <= kPlocMostLooks + static_cast<unsigned>(std::bit_width(count - 1)));
      }
    }
}

TEST_CASE("subtrees that are too deep are rebuilt by halving") {
  // Boxes whose size doubles: the nearest neighbour of each is the previous one.
  Machine machine;
  const std::uint32_t count = 250;
  std::vector<Box> boxes;
  for (std::uint32_t i = 0; i < count; ++i) {
    const float size = std::ldexp(1.0f, static_cast<int>(i) - 124);
    boxes.push_back(Box{{0, 0, 0}, {size, size, size}});
  }
  for (const Builder builder : {Builder::kLbvh, Builder::kLbvh30, Builder::kPloc, Builder::kHploc}) {
    const DepthFirstTree tree = built(machine, builder, boxes);
    CAPTURE(static_cast<int>(builder));
    CHECK(depth(tree, 0) <= kMaxDepth);
    Subsets subsets;
    add_subsets(tree, 0, subsets);
    CHECK(subsets.size() == 2 * count - 1);
  }
}
