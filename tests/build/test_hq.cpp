// The steps of the builder hq: reinsertion and pre-split references.

#include <hiprt_build/input/references.h>
#include <hiprt_build/lbvh_ploc/cluster.h>
#include <hiprt_build/pair/pair.h>
#include <hiprt_build/presplit/presplit.h>
#include <hiprt_build/reinsert/reinsert_rounds.h>
#include <hiprt_build/statistics.h>
#include <tests/build/machine.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/catch.h>

#include <map>

using namespace hiprt;
using namespace hiprt::oracle;
using namespace hiprt::build;

namespace {

using Linked = LinkedTree<BoxLeaves>;
using Tree = ParentedTree<Linked>;

double cost_of(const Mesh& mesh, const BuildOptions& options) {
  const auto bvh = build::build(std::vector{mesh.view()}, options);
  REQUIRE(bvh.has_value());
  return measure_tree(*open_buffer(bvh->buffer.bytes())).sah_cost;
}

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

namespace {

/// The leaves of a mesh, and the references of its pre-split.
struct PreSplit {
  BuildInput input;
  PairedPrimitives paired;
  std::vector<Box> boxes;               ///< Of the leaves.
  std::vector<std::vector<Box>> parts;  ///< Of each leaf: its references' boxes.
  std::size_t references = 0;

  PreSplit(Machine& machine, const std::vector<TriangleMesh>& meshes, double budget)
      : input(SceneInput{meshes, {}}), paired(pair_primitives(machine.engine, input, true)), parts(paired.count) {
    auto whole = machine.engine.allocate<Reference>(paired.count);
    machine.engine.for_each(paired.count, MakeReferenceStep{input.table(), paired.leaves.span(), whole.span()});
    for (std::size_t i = 0; i < paired.count; ++i) boxes.push_back(whole[i].box);
    std::map<std::uint32_t, std::size_t> leaf_of;
    for (std::size_t i = 0; i < paired.count; ++i) leaf_of[paired.leaves[i].primitive] = i;
    const auto split = presplit(machine.engine, input.table(), std::move(whole), budget);
    references = split.size();
    for (const Reference& part : split.span()) parts[leaf_of.at(part.primitive)].push_back(part.box);
  }
};

/// Every part is a box within its leaf's box.
void check_parts_within(const PreSplit& split) {
  for (std::size_t leaf = 0; leaf < split.parts.size(); ++leaf)
    for (const Box& inner : split.parts[leaf]) {
      const Box& outer = split.boxes[leaf];
      for (int axis = 0; axis < 3; ++axis) {
        REQUIRE(outer.min[axis] <= inner.min[axis]);
        REQUIRE(inner.min[axis] <= inner.max[axis]);
        REQUIRE(inner.max[axis] <= outer.max[axis]);
      }
    }
}

/// Whether a box contains the point of the first triangle with these barycentric weights, up to rounding.
bool holds_point(const Box& box, const LeafCorners& corners, const double (&w)[3]) {
  const double sum = w[0] + w[1] + w[2];
  bool inside = true;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const double x = (w[0] * double{corners.v[0].x[axis]} + w[1] * double{corners.v[1].x[axis]} +
                      w[2] * double{corners.v[2].x[axis]}) /
                     sum;
    const double slack = 1e-12 * std::abs(x);
    inside = inside && x >= double{box.min[axis]} - slack && x <= double{box.max[axis]} + slack;
  }
  return inside;
}

/// Points of every leaf's first triangle are in one of the leaf's parts.
void check_parts_cover(const PreSplit& split, Random& random) {
  for (std::size_t leaf = 0; leaf < split.parts.size(); ++leaf) {
    const LeafCorners corners = leaf_corners(split.input.table(), split.paired.leaves[leaf]);
    for (int i = 0; i < 20; ++i) {
      // A point of the triangle, or a corner.
      double w[3] = {random.unit(), random.unit(), random.unit()};
      if (i < 3) w[0] = i == 0, w[1] = i == 1, w[2] = i == 2;
      REQUIRE(std::any_of(split.parts[leaf].begin(), split.parts[leaf].end(),
                          [&](const Box& box) { return holds_point(box, corners, w); }));
    }
  }
}

}  // namespace

TEST_CASE("pre-splits stay in their triangles' boxes, cover the triangles and keep to the budget") {
  Machine machine;
  constexpr std::uint64_t kSeed = 4;
  Random random(kSeed);
  INFO("seed " << kSeed);
  for (const Mesh& mesh : {icosphere(3), soup(2000, 0.5, 1), needles(2000, 1e4, 2), torture(2000, 3), identical(100),
                           oracle::placed(soup(500, 0.5, 5), 1e30), oracle::placed(soup(500, 0.5, 6), 1e-30)})
    for (const double budget : {1.0, 1.01, 1.5, 8.0}) {
      const std::vector<TriangleMesh> meshes{mesh.view()};
      const PreSplit split(machine, meshes, budget);
      CAPTURE(mesh.triangles.size(), budget, split.paired.count, split.references);
      REQUIRE(split.references >= split.paired.count);
      REQUIRE(static_cast<double>(split.references) <= budget * static_cast<double>(split.paired.count));
      check_parts_within(split);
      check_parts_cover(split, random);
    }
}

TEST_CASE("pre-splits lower the cost of trees over long triangles, and a larger budget lowers it further") {
  const Mesh mesh = needles(20000, 1e3, 6);
  double cost[3];
  int i = 0;
  for (const double budget : {1.0, 1.5, 4.0})
    cost[i++] = cost_of(mesh, {.builder = Builder::kHploc, .presplit_budget = budget, .reinsertion_rounds = 32});
  CHECK(cost[1] < 0.95 * cost[0]);
  CHECK(cost[2] < 0.95 * cost[1]);
}

TEST_CASE("costs compared with Embree's high quality: sbvh with reinsertion, hq, and pre-split hploc") {
  std::printf("%-12s %8s %8s %8s %8s %8s\n", "mesh", "sbvh", "sbvh+8", "hq", "cheaper", "high");
  for (const auto& [name, mesh] :
       {std::pair("icosphere", icosphere(6)), std::pair("star", star(6, 2)), std::pair("soup", soup(50000, 0.05, 4)),
        std::pair("large soup", soup(20000, 0.5, 5)), std::pair("needles", needles(20000, 1e3, 6))}) {
    const double sbvh = cost_of(mesh, {.builder = Builder::kSbvh});
    const double moved = cost_of(mesh, {.builder = Builder::kSbvh, .reinsertion_rounds = 8});
    const double hq = cost_of(mesh, {.builder = Builder::kHq}), high = cost_of(mesh, {.builder = oracle::kEmbreeHigh});
    const double cheaper =
        cost_of(mesh, {.builder = Builder::kHploc, .presplit_budget = 1.5, .reinsertion_rounds = 32});
    std::printf("%-12s %8.2f %8.2f %8.2f %8.2f %8.2f\n", name, sbvh, moved, hq, cheaper, high);
    CHECK(moved <= 1.001 * sbvh);
    CHECK(moved <= 1.05 * high);
    CHECK(hq <= 1.001 * moved);
    CHECK(cheaper <= 1.05 * high);
  }
}
