// Reinsertion: the search for new places, moves at the same time, and where the rounds end.

#include <hiprt_build/lbvh_ploc/cluster.h>
#include <hiprt_build/reinsert/reinsert_rounds.h>
#include <tests/build/machine.h>

#include <tests/catch.h>

#include <algorithm>
#include <set>
#include <vector>

using namespace hiprt;
using namespace hiprt::oracle;
using namespace hiprt::build;

namespace {

using Linked = LinkedTree<BoxLeaves>;
using Tree = ParentedTree<Linked>;

/// A tree of random shape over random boxes.
struct RandomTree {
  RandomTree(Random& random, std::uint32_t count) : nodes(count), counts(count), parents(2 * count), met(count) {
    for (std::uint32_t i = 0; i < count; ++i) boxes.push_back(random_box(random));
    const Linked linked{{boxes.data()}, nodes.data(), {counts.data()}, &root};
    std::vector<Cluster> clusters;
    for (std::uint32_t i = 0; i < count; ++i) clusters.push_back(leaf_cluster(boxes[i], i));
    while (clusters.size() > 1) {
      const std::uint32_t a = random.below(static_cast<std::uint32_t>(clusters.size()));
      std::swap(clusters[a], clusters.back());
      const Cluster last = clusters.back();
      clusters.pop_back();
      Cluster& other = clusters[random.below(static_cast<std::uint32_t>(clusters.size()))];
      other = other.free < last.free ? join(linked, other, last) : join(linked, last, other);
    }
    root = clusters[0].ref;
  }
  Tree tree() { return Tree{{{boxes.data()}, nodes.data(), {counts.data()}, &root}, size(), parents.data()}; }
  std::uint32_t size() const { return static_cast<std::uint32_t>(boxes.size()); }

  /// Checks boxes, counts and parents below @p ref, and that no leaf is there twice. @return the area of inner nodes.
  double check(LinkedRef ref, std::set<std::uint32_t>& leaves) {
    if ((ref & kLinkedLeaf) != 0) {
      REQUIRE(leaves.insert(ref & ~kLinkedLeaf).second);
      return 0;
    }
    const LinkedNode& node = nodes.at(ref);
    const std::size_t before = leaves.size();
    double area = double{half_area(node.box)};
    for (const LinkedRef child : node.child) {
      REQUIRE(tree().parent(child) == ref);
      area += check(child, leaves);
    }
    REQUIRE(counts[ref] == leaves.size() - before);
    const Box box = unite(tree().tree.box(node.child[0]), tree().tree.box(node.child[1]));
    REQUIRE(same(box, node.box));
    return area;
  }
  /// Nodes on the longest path down from @p ref, a leaf included.
  std::uint32_t height(LinkedRef ref) const {
    if ((ref & kLinkedLeaf) != 0) return 1;
    const LinkedNode& node = nodes.at(ref);
    return 1 + std::max(height(node.child[0]), height(node.child[1]));
  }
  double area() {
    std::set<std::uint32_t> leaves;
    const double result = check(root, leaves);
    REQUIRE(leaves.size() == boxes.size());
    return result;
  }
  void refit() {
    std::fill(met.begin(), met.end(), 0u);
    for (std::uint32_t i = 0; i < size(); ++i) RefitStep<Linked>{tree(), met.data()}(i);
  }
  void set_parents() {
    tree().parent(root) = kInvalidId;
    for (std::uint32_t i = 0; i + 1 < size(); ++i) SetParentsStep<Linked>{tree()}(i);
  }

  std::vector<Box> boxes;
  std::vector<LinkedNode> nodes;
  std::vector<std::uint32_t> counts, parents, met;
  LinkedRef root = kInvalidId;
};

/// All subtrees look at once.
constexpr Lookers kAll{0, 0};

/// Where every subtree wants to go.
std::vector<Reinsertion> find_all(RandomTree& random_tree) {
  std::vector<Reinsertion> found(2 * random_tree.size());
  for (std::uint32_t i = 0; i < found.size(); ++i)
    FindReinsertionStep<Linked>{random_tree.tree(), kAll, found.data()}(i);
  return found;
}

/// Moves one subtree.
void move(RandomTree& random_tree, std::uint32_t number, LinkedRef beside) {
  std::vector<Reinsertion> found(2 * random_tree.size(), Reinsertion{0, kInvalidId, kInvalidId});
  std::vector<std::uint8_t> granted(found.size());
  found[number] = {1, beside, kInvalidId};
  granted[number] = 1;
  ReinsertStep<Linked>{random_tree.tree(), kAll, found.data(), granted.data()}(number);
  random_tree.refit();
}

bool is_below(RandomTree& tree, LinkedRef ref, LinkedRef above) {
  for (; ref != above; ref = tree.tree().parent(ref))
    if (ref == tree.root) return false;
  return true;
}

/// The most area that moving a subtree saves, by moving it everywhere.
double best_gain(const RandomTree& start, std::uint32_t number) {
  RandomTree tree = start;
  const LinkedRef moving = subtree(tree.tree(), number);
  const std::uint32_t parent = tree.tree().parent(moving);
  const LinkedRef sibling = tree.tree().sibling(moving);
  const double before = tree.area();
  double best = 0;
  for (std::uint32_t other = 1; other < 2 * tree.size(); ++other) {
    const LinkedRef beside = subtree(tree.tree(), other);
    // Not to where it is, nor above itself or beside an ancestor, which the search leaves out too.
    if (beside == sibling || is_below(tree, beside, moving) || is_below(tree, parent, beside)) continue;
    RandomTree moved = start;
    move(moved, number, beside);
    best = std::max(best, before - moved.area());
  }
  return best;
}

}  // namespace

TEST_CASE("reinsertion finds the position that reduces the area most") {
  constexpr std::uint64_t kSeed = 1;
  Random random(kSeed);
  INFO("seed " << kSeed);
  int moves = 0;
  for (int round = 0; round < 60; ++round) {
    RandomTree tree(random, 3 + random.below(9));
    tree.set_parents();
    const std::vector<Reinsertion> found = find_all(tree);
    CAPTURE(round, tree.size());
    for (std::uint32_t i = 1; i < found.size(); ++i) {
      const std::uint32_t parent = tree.parents[i];
      if (parent == kInvalidId || tree.parents[parent] == kInvalidId) {
        CHECK(found[i].gain == 0.0f);
        continue;
      }
      CHECK(double{found[i].gain} == Approx(best_gain(tree, i)).epsilon(1e-4).margin(1e-5));
      if (!(found[i].gain > 1e-4f)) continue;
      ++moves;
      RandomTree moved = tree;
      move(moved, i, found[i].beside);
      CHECK(tree.area() - moved.area() == Approx(found[i].gain).epsilon(1e-3));
    }
  }
  CHECK(moves > 100);
}

namespace {

/// A tree that counts the boxes that are read.
struct CountingTree : Linked {
  unsigned* reads;

  FastBox fast_box(LinkedRef ref) const {
    ++*reads;
    return Linked::fast_box(ref);
  }
};

/// Boxes that the searches of all subtrees read.
struct Looks {
  unsigned most = 0;
  double mean = 0;
};

Looks count_looks(RandomTree& random_tree) {
  const Tree plain = random_tree.tree();
  unsigned reads = 0;
  const ParentedTree<CountingTree> tree{{plain.tree, &reads}, plain.leaves, plain.parents};
  std::vector<Reinsertion> found(2 * random_tree.size());
  Looks looks;
  for (std::uint32_t i = 1; i < found.size(); ++i) {
    reads = 0;
    FindReinsertionStep<CountingTree>{tree, kAll, found.data()}(i);
    looks.most = std::max(looks.most, reads);
    looks.mean += static_cast<double>(reads) / static_cast<double>(found.size());
  }
  return looks;
}

}  // namespace

TEST_CASE("a search of reinsertion looks at a limited number of boxes, however many overlap") {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  INFO("seed " << kSeed);
  // The box of the subtree itself is read too.
  constexpr unsigned kMost = FindReinsertionStep<CountingTree>::kMostLooks + 1;
  for (const std::uint32_t count : {100u, 1000u, 30000u}) {
    RandomTree tree(random, count);
    tree.set_parents();
    const Looks looks = count_looks(tree);
    CAPTURE(count, looks.mean);
    CHECK(looks.most <= kMost);
    // These boxes need the limit.
    if (count > 100) CHECK(looks.most >= kMost - 1);
  }
}

TEST_CASE("simultaneous reinsertions keep the tree valid, and the subtree with the largest gain moves") {
  constexpr std::uint64_t kSeed = 2;
  Random random(kSeed);
  INFO("seed " << kSeed);
  std::size_t refused = 0, moved = 0;
  for (int round = 0; round < 300; ++round) {
    RandomTree tree(random, 3 + random.below(100));
    tree.set_parents();
    for (int pass = 0; pass < 5; ++pass) {
      const std::vector<Reinsertion> found = find_all(tree);
      std::vector<ReinsertionBids> bids(found.size(), ReinsertionBids{0, 0});
      std::vector<std::uint8_t> granted(found.size());
      for (std::uint32_t i = 0; i < found.size(); ++i)
        BidReinsertionStep<Linked>{tree.tree(), kAll, found.data(), bids.data()}(i);
      for (std::uint32_t i = 0; i < found.size(); ++i)
        GrantReinsertionStep<Linked>{tree.tree(), kAll, found.data(), bids.data(), granted.data()}(i);
      const auto most = std::max_element(found.begin(), found.end(), [](const Reinsertion& a, const Reinsertion& b) {
        return a.gain <= b.gain;  // The last of equal ones has the highest bid.
      });
      CAPTURE(round, pass, tree.size());
      REQUIRE(granted[static_cast<std::size_t>(most - found.begin())] == (most->gain > 0.0f ? 1 : 0));
      for (std::uint32_t i = 0; i < found.size(); ++i) {
        moved += granted[i];
        refused += found[i].gain > 0.0f && granted[i] == 0 ? 1 : 0;
      }
      for (std::uint32_t i = 0; i < found.size(); ++i)
        ReinsertStep<Linked>{tree.tree(), kAll, found.data(), granted.data()}(i);
      tree.refit();
      tree.area();
    }
  }
  CHECK(moved > 1000);
  CHECK(refused > 1000);
}

TEST_CASE("rounds of reinsertion never increase the area, also in trees of one to four leaves") {
  Random random(3);
  for (const std::uint32_t count : {1u, 2u, 3u, 4u, 1000u}) {
    RandomTree tree(random, count);
    tree.set_parents();
    const double before = tree.area();
    Machine machine;
    reinsert(machine.engine, tree.tree(), 64);
    const double after = tree.area();
    CHECK(after <= before);
    if (count == 1000) CHECK(after < 0.5 * before);
  }
}

TEST_CASE("a refit tells the height of a tree") {
  Random random(4);
  for (const std::uint32_t count : {1u, 2u, 3u, 17u, 300u}) {
    RandomTree tree(random, count);
    tree.set_parents();
    // A single leaf is below no node: nothing is refitted.
    std::uint32_t height = 1;
    std::fill(tree.met.begin(), tree.met.end(), 0u);
    for (std::uint32_t i = 0; i < count; ++i) RefitStep<Linked>{tree.tree(), tree.met.data(), &height}(i);
    CHECK(height == tree.height(tree.root));
    tree.area();
  }
}

TEST_CASE("rounds of reinsertion end with the one that makes the tree too high") {
  // Boxes around the origin, each a little smaller: the smallest area is that of a chain.
  constexpr std::uint32_t kBoxes = 400;
  Random random(6);
  RandomTree start(random, kBoxes);
  for (std::uint32_t i = 0; i < kBoxes; ++i) {
    const float s = 1.0f - static_cast<float>(i) / (2 * kBoxes);
    start.boxes[i] = Box{{-s, -s, -s}, {s, s, s}};
  }
  start.set_parents();
  start.refit();
  std::uint32_t height = start.height(start.root);
  double area = start.area();
  REQUIRE(height < kMostReinsertionHeight);
  Machine machine;
  unsigned ended_after = 0;
  for (unsigned rounds = 1; rounds <= 40; ++rounds) {
    RandomTree tree = start;
    reinsert(machine.engine, tree.tree(), rounds);
    const double now = tree.area();
    CAPTURE(rounds, height, tree.height(tree.root));
    if (height > kMostReinsertionHeight) {
      if (ended_after == 0) ended_after = rounds - 1;
      CHECK(now == area);
    } else {
      CHECK(now < area);
    }
    height = tree.height(tree.root);
    area = now;
  }
  CHECK(ended_after > 2);
  CHECK(ended_after < 39);
}
