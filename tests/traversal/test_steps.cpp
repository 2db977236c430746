// Single steps of queries: the exact room of stacks, nodes that are popped and not visited, and how far a spawned ray
// moves.

#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/traverse/stacks/rolling.h>
#include <hiprt_device/traverse/stacks/shared.h>
#include <hiprt_device/traverse/stacks/tiered.h>
#include <tests/oracle/random.h>
#include <tests/traversal/chain.h>

#include <tests/catch.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

/// Pushes until the stack says that it is full: there is room for kMostPushed more iff they fit. An empty stack with a
/// bottom pops it any number of times.
template <class Stack, class Entry> void check_room(const typename Stack::Storage& storage, unsigned capacity) {
  typename Stack::template Of<Entry> stack(storage);
  CAPTURE(capacity);
  for (unsigned i = 1; i <= capacity; ++i) {
    CAPTURE(i);
    REQUIRE(stack.has_room() == (i - 1 + kMostPushed <= capacity));
    stack.push(Entry(i));
  }
  CHECK_FALSE(stack.has_room());
  for (unsigned i = capacity; i > 0; --i) REQUIRE(stack.pop() == Entry(i));
  CHECK(stack.empty());
  if constexpr (requires { Stack::template Of<Entry>::kHasBottom; })
    for (unsigned i = 0; i < 3; ++i) REQUIRE(stack.pop() == bottom_entry<Entry>());
  CHECK(stack.has_room() == (kMostPushed <= capacity));
}

template <unsigned kEntries, class Entry> void check_private_room() {
  typename PrivateStack<kEntries>::Memory memory;
  check_room<PrivateStack<kEntries>, Entry>(memory, kEntries);
}
template <unsigned kShared, unsigned kEntries, class Entry> void check_tiered_room() {
  using Stack = TieredStack<kShared, kEntries>;
  constexpr unsigned kThreads = 3;
  std::vector<StackEntry> block(kThreads * (kShared + 1));
  typename Stack::Memory memory;
  const typename Stack::Storage storage(block.data(), 1, kThreads, memory);
  check_room<Stack, Entry>(storage, kEntries);
  // The entries of one node, pushed together, may lie on both sides of the border. No entry has a value twice.
  for (unsigned before = 0; before + kMostPushed <= kEntries; ++before) {
    CAPTURE(kShared, before);
    const auto entry = [&](unsigned i) { return Entry{100 * before + 50 + i}; };
    typename Stack::template Of<Entry> stack(storage);
    for (unsigned i = 0; i < before; ++i) stack.push(entry(i));
    stack.push_some([&](auto&& push) {
      for (unsigned i = 0; i < kMostPushed; ++i) push(entry(before + i));
    });
    for (unsigned i = before + kMostPushed; i-- > 0;) REQUIRE(stack.pop() == entry(i));
    REQUIRE(stack.empty());
  }
}

/// The next node by a usual step, where that and @p may_be_usual allow it, or by the step for every ray.
template <class Backtrack>
NodeRef next_sorted(Backtrack& backtrack, const NodeRef (&child)[kBranching], bool may_be_usual,
                    unsigned& usual_steps) {
  if constexpr (requires { backtrack.is_usual(0u); }) {
    REQUIRE_FALSE(backtrack.is_usual(~0u));
    if (may_be_usual && backtrack.is_usual(0u)) {
      ++usual_steps;
      return backtrack.next_usual(child, backtrack.top());
    }
  }
  return backtrack.next_sorted(child, std::numeric_limits<float>::infinity());
}

/// Nodes whose children are sorted, with random numbers of them, beside a vector.
/// @param capacity of the stack. @param most references that its memory holds: a tiered stack may have more.
/// @return number of usual steps (StackBacktrack::is_usual()).
template <class Stack>
unsigned check_sorted(const typename Stack::Storage& storage, unsigned capacity, unsigned most, Random& random) {
  CAPTURE(capacity, most);
  BacktrackOf<Stack, NodeRef> backtrack(storage, NodeRef{8});
  std::vector<NodeRef> expected;
  NodeRef number = 16;
  unsigned usual_steps = 0;
  for (unsigned step = 0; step < 4000; ++step) {
    // In turn the stack mostly grows and mostly shrinks. It is often empty, and often full.
    const bool grows = step / 50 % 2 == 0;
    const std::size_t children = random.below(4) == 0 ? random.below(kBranching + 1) : grows ? kBranching : 0;
    NodeRef child[kBranching];
    for (unsigned i = 0; i < kBranching; ++i) child[i] = i < children ? number++ : kInvalidRef;
    const bool has_room = expected.size() + kMostPushed <= capacity;
    REQUIRE(backtrack.reserve() == has_room);
    const NodeRef next = next_sorted(backtrack, child, random.coin(), usual_steps);
    if (children == 0) {
      REQUIRE(next == (expected.empty() ? kInvalidRef : expected.back()));
      if (!expected.empty()) expected.pop_back();
    } else if (next == kOverflowRef) {
      REQUIRE_FALSE(has_room);
    } else {
      REQUIRE(next == child[0]);
      REQUIRE(expected.size() + children - 1 <= most);
      for (std::size_t i = children - 1; i > 0; --i) expected.push_back(child[i]);
    }
    REQUIRE(backtrack.empty() == expected.empty());
  }
  return usual_steps;
}

template <unsigned kShared, unsigned kEntries> void check_tiered_sorted(Random& random) {
  CAPTURE(kShared);
  using Stack = TieredStack<kShared, kEntries>;
  constexpr unsigned kThreads = 3;
  std::vector<StackEntry> block(kThreads * kShared);
  typename Stack::Memory memory;
  const unsigned usual_steps =
      check_sorted<Stack>({block.data(), 1, kThreads, memory}, kEntries, std::max(kEntries, 2 * kShared), random);
  CHECK((usual_steps > 0) == (2 * kShared > kMostPushed));
}

struct Counting : Policies {
  using Counter = WorkCounter;
};
struct CountingLater : Counting {
  using Schedule = Postponed;
};
template <class AnyStack> struct WithStack : Policies { using Stack = AnyStack; };

NodeRef child_ref(unsigned i) { return make_ref(256 * (i + 1), NodeType::kBox32); }

/// The children of a node in the order in which they are visited.
/// @param rank of their distances. @param met bit per child: it is met.
template <class Order, class Lanes>
std::vector<NodeRef> visited(const unsigned (&rank)[kBranching], std::uint32_t met) {
  const NodeRef child[kBranching] = {child_ref(0), child_ref(1), child_ref(2), child_ref(3)};
  const auto at = [&](unsigned i) { return 1.0f + static_cast<float>(rank[i]); };
  const BoxHits<Lanes> hits(Lanes::set(at(0), at(1), at(2), at(3)), Lanes::all(8.0f), met);
  PrivateStack<kBranching>::Memory memory;
  using Backtrack = BacktrackOf<PrivateStack<kBranching>, typename Order::Entry>;
  Backtrack backtrack(PrivateStack<kBranching>::Storage(memory), kInvalidRef);
  std::vector<NodeRef> result;
  for (NodeRef next = Order::next(child, hits, backtrack); next != kInvalidRef; next = backtrack.pop(8.0f))
    result.push_back(next);
  return result;
}

/// A node with three leaves and a node. A ray along z enters their boxes at 1, 2, 6 and 3 and meets the triangles at 4,
/// 5 and 6. It misses the leaf below the inner node. With y below 0.5 it misses that node, too.
class Fork {
 public:
  Fork() {
    geometry_.mask = 0xffffffffu;
    set_leaf(0, {{0, 0, 1}, {1, 1, 4}}, 4);
    set_leaf(1, {{0, 0, 2}, {1, 1, 5}}, 5);
    set_leaf(2, {{0, 0, 6}, {1, 1, 6}}, 6);
    set_leaf(3, {{2, 2, 3}, {3, 3, 3}}, 3);
    set_child(0, 3, make_ref(offsetof(Tree, node[1]), NodeType::kBox32), {{0, 0.5f, 3}, {3, 3, 8}});
    set_child(1, 0, leaf_ref(3), {{2, 2, 3}, {3, 3, 3}});
    for (unsigned child = 1; child < kBranching; ++child) set_child(1, child, kInvalidRef, kNone);
  }

  SceneView view() const {
    SceneView scene{.base = reinterpret_cast<const std::byte*>(&tree_), .size = sizeof tree_, .geometries = &geometry_};
    scene.root = make_ref(0, NodeType::kBox32);
    scene.bounds = {{0, 0, 1}, {3, 3, 8}};
    scene.features = feature_bit(Feature::kTriangles);
    return scene;
  }

 private:
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  static constexpr Box kNone{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
  struct alignas(256) Tree {
    PlanesBoxNode node[2];
    PlanesLeaf leaf[4];
  };

  static NodeRef leaf_ref(unsigned i) {
    return make_ref(offsetof(Tree, leaf) + i * sizeof(PlanesLeaf), NodeType::kTriangle0);
  }
  void set_child(unsigned node, unsigned child, NodeRef ref, const Box& box) {
    tree_.node[node].child[child] = ref;
    PlanesLayout::set_box(tree_.node[node], child, box);
  }
  /// A triangle of the box's low corner at height z.
  void set_leaf(unsigned i, const Box& box, float z) {
    if (i < 3) set_child(0, i, leaf_ref(i), box);
    constexpr float kCorners[4][2] = {{0, 0}, {1, 0}, {0, 1}, {0, 1}};
    for (unsigned vertex = 0; vertex < 4; ++vertex) {
      tree_.leaf[i].coordinate[0][vertex] = box.min[0] + kCorners[vertex][0];
      tree_.leaf[i].coordinate[1][vertex] = box.min[1] + kCorners[vertex][1];
      tree_.leaf[i].coordinate[2][vertex] = z;
    }
    tree_.leaf[i].info = {{i, kInvalidId}, kLastInRun, TriangleId::from_rotation(0)};
  }

  Tree tree_{};
  GeometryRecord geometry_{};
};

}  // namespace

TEST_CASE("sorted children are pushed and popped in order, in every stack", "[stack]") {
  constexpr std::uint64_t kSeed = 33;
  INFO("seed " << kSeed);
  Random random(kSeed);
  PrivateStack<9>::Memory memory;
  check_sorted<PrivateStack<9>>(memory, 9, 9, random);
  std::vector<StackEntry> block(3 * 9);
  check_sorted<SharedStack<9>>({block.data(), 1, 3}, 9, 9, random);
  check_tiered_sorted<1, 9>(random);
  check_tiered_sorted<2, 9>(random);
  check_tiered_sorted<4, 16>(random);
  check_tiered_sorted<8, 9>(random);
}

TEMPLATE_TEST_CASE("Unordered visits the children that are met as they are stored", "", ArrayLanes, DefaultLanes) {
  constexpr unsigned kRank[kBranching] = {2, 0, 3, 1};
  for (unsigned met = 1; met < 1u << kBranching; ++met) {
    CAPTURE(met);
    std::vector<NodeRef> expected;
    for (unsigned i = 0; i < kBranching; ++i)
      if ((met >> i & 1u) != 0) expected.push_back(child_ref(i));
    REQUIRE(visited<Unordered, TestType>(kRank, met) == expected);
  }
}

TEMPLATE_TEST_CASE("the nearest child that is met comes first; NearFirst visits the others by their distance", "",
                   ArrayLanes, DefaultLanes) {
  unsigned rank[kBranching] = {0, 1, 2, 3};
  do
    for (unsigned met = 1; met < 1u << kBranching; ++met) {
      CAPTURE(rank[0], rank[1], rank[2], rank[3], met);
      std::vector<std::pair<unsigned, NodeRef>> nearest;
      for (unsigned i = 0; i < kBranching; ++i)
        if ((met >> i & 1u) != 0) nearest.push_back({rank[i], child_ref(i)});
      std::sort(nearest.begin(), nearest.end());
      std::vector<NodeRef> expected;
      for (const auto& [distance, ref] : nearest) expected.push_back(ref);
      REQUIRE(visited<NearFirst, TestType>(rank, met) == expected);
      const std::vector<NodeRef> others = visited<NearestFirst, TestType>(rank, met);
      REQUIRE(others.front() == expected.front());
      REQUIRE(std::is_permutation(others.begin(), others.end(), expected.begin(), expected.end()));
    }
  while (std::next_permutation(std::begin(rank), std::end(rank)));
}

TEMPLATE_TEST_CASE("stacks have room for exactly their capacity", "", StackEntry, NodeRef) {
  constexpr unsigned kThreads = 3;
  std::vector<StackEntry> block(kThreads * 16), global(kThreads * 32);
  check_room<SharedStack<3>, TestType>({block.data(), 1, kThreads}, 3);
  check_room<SharedStack<7>, TestType>({block.data(), 1, kThreads}, 7);
  for (const std::uint32_t spilled : {0u, 1u, 5u, 20u}) {
    const Spill spill = grid_spill(global.data(), kThreads, spilled, 1);
    check_room<RollingStack<4>, TestType>({block.data(), 1, kThreads, spill}, 4 + spilled);
    check_room<RollingStack<8>, TestType>({block.data(), 1, kThreads, spill}, 8 + spilled);
    check_room<GlobalStack, TestType>(typename GlobalStack::Storage(spill), spilled);
  }
  check_private_room<2, TestType>();
  check_private_room<3, TestType>();
  check_private_room<16, TestType>();
  // With capacities at the border of shared memory, and kMostPushed around it.
  check_tiered_room<1, 3, TestType>();
  check_tiered_room<4, 5, TestType>();
  check_tiered_room<4, 7, TestType>();
  check_tiered_room<4, 16, TestType>();
}

TEST_CASE("a stack traces the deepest tree that its capacity has room for, and no deeper one") {
  // Each node leaves one entry behind. A visit needs room for kMostPushed.
  constexpr unsigned kEntries = 12, kLevels = kEntries - kMostPushed + 1;
  std::vector<StackEntry> block(kEntries);
  TieredStack<4, kEntries>::Memory memory;
  for (const unsigned levels : {kLevels - 1, kLevels, kLevels + 1}) {
    CAPTURE(levels);
    const Chain chain(levels);
    const SceneView scene = chain.view();
    const Ray down{.origin = {0.25f, 0.25f, 100.0f}, .direction = {0, 0, -1}};
    std::uint32_t overflows = 0;
    const auto check = [&](const Hit& hit) {
      REQUIRE(hit.failed() == (levels > kLevels));
      REQUIRE(hit.found() == (levels <= kLevels));
      REQUIRE(overflows == (levels > kLevels ? 1u : 0u));
      overflows = 0;
    };
    PrivateStack<kEntries>::Memory own;
    check(
        closest_hit<WithStack<PrivateStack<kEntries>>>(scene, down, PrivateStack<kEntries>::Storage(own, &overflows)));
    check(closest_hit<WithStack<TieredStack<4, kEntries>>>(
        scene, down, TieredStack<4, kEntries>::Storage(block.data(), 0, 1, memory, &overflows)));
    check(closest_hit<WithStack<SharedStack<kEntries>>>(
        scene, down, SharedStack<kEntries>::Storage(block.data(), 0, 1, &overflows)));
  }
}

TEST_CASE("nodes beyond the hit are popped and not visited") {
  const Chain chain(60);
  const SceneView scene = chain.view();
  // From above the last triangle: the chain is entered at the root, and each leaf is farther than what lies below it.
  const Ray down{.origin = {0.25f, 0.25f, 100.0f}, .direction = {0, 0, -1}};
  Counting::Stack::Memory memory;
  ClosestHit<Counting> query(scene, down, memory);
  const Hit hit = query.next_hit();
  REQUIRE(hit.primitive == 59);
  // The nearest leaf is deepest. Every leaf beside the path stays on the stack, beyond the hit.
  CHECK(query.counter().box_tests == 60);
  CHECK(query.counter().leaf_tests == 1);
  // From below the first leaf is the hit: the rest of the chain is on the stack.
  const Ray up{.origin = {0.25f, 0.25f, -1.0f}, .direction = {0, 0, 1}};
  Counting::Stack::Memory other;
  ClosestHit<Counting> first(scene, up, other);
  REQUIRE(first.next_hit().primitive == 0);
  CHECK(first.counter().box_tests == 1);
  CHECK(first.counter().leaf_tests == 1);
}

TEST_CASE("what lies beyond the hit is not visited behind a node without a hit, nor behind a leaf") {
  const Fork fork;
  const SceneView scene = fork.view();
  const auto check = [&]<class P>(P, float y, std::uint32_t boxes) {
    const Ray ray{.origin = {0.25f, y, 0.0f}, .direction = {0, 0, 1}};
    typename P::Stack::Memory memory;
    ClosestHit<P> query(scene, ray, memory);
    const Hit hit = query.next_hit();
    REQUIRE(hit.primitive == 0);
    REQUIRE(hit.t == 4.0f);
    CHECK(query.counter().box_tests == boxes);
    CHECK(query.counter().leaf_tests == 2);
  };
  check(Counting{}, 0.6f, 2);
  check(Counting{}, 0.25f, 1);
  check(CountingLater{}, 0.6f, 2);
  check(CountingLater{}, 0.25f, 1);
}

TEMPLATE_TEST_CASE("triangles beyond a point's region are passed over, also far from zero", "", ArrayLanes,
                   DefaultLanes) {
  const SceneView scene{.bounds = {{100, 0, 0}, {101, 1, 0}}};
  PlanesLeaf leaf{};
  constexpr float kCorners[4][2] = {{100, 0}, {101, 0}, {100, 1}, {101, 1}};
  for (unsigned vertex = 0; vertex < 4; ++vertex)
    for (unsigned axis = 0; axis < 2; ++axis) leaf.coordinate[axis][vertex] = kCorners[vertex][axis];
  // At a distance of 3 from both triangles.
  const auto outside = [&](double squared) {
    return PointRegion<TestType, 0>(scene, Vec3D(100.5, 0.5, 3), squared).outside(leaf) & 3u;
  };
  CHECK(outside(8.9) == 3);
  CHECK(outside(9.1) == 0);
}

TEST_CASE("a spawned ray starts as far from the surface as the error bound requires, and not much farther") {
  constexpr std::uint64_t kSeed = 20261127;
  Random random(kSeed);
  for (unsigned i = 0; i < 20000; ++i) {
    Hit hit;
    hit.t = 1.0f;
    hit.geometry = hit.primitive = 0;
    hit.error = static_cast<float>(random.log_uniform(1e-6, 1e-2));
    // Normals of any length, most of them not along an axis.
    const double length = random.log_uniform(1e-6, 1e6);
    const auto n = random.on_sphere(), away = random.on_sphere();
    hit.normal =
        Vec3(static_cast<float>(n[0] * length), static_cast<float>(n[1] * length), static_cast<float>(n[2] * length));
    const Ray ray{.origin = {0, 0, 0}, .direction = {0x1p-20f, 0x1p-20f, 0x1p-20f}};
    const Vec3 direction(static_cast<float>(away[0]), static_cast<float>(away[1]), static_cast<float>(away[2]));
    const Vec3 from = spawn_origin(ray, hit, direction);
    const double x = hit.normal.x, y = hit.normal.y, z = hit.normal.z, size = std::sqrt(x * x + y * y + z * z);
    const double moved =
        ((double{from.x} - 0x1p-20) * x + (double{from.y} - 0x1p-20) * y + (double{from.z} - 0x1p-20) * z) / size;
    const double needed = hit.error * (std::fabs(x) + std::fabs(y) + std::fabs(z)) / size;
    INFO("seed " << kSeed << ", hit " << i);
    REQUIRE(std::fabs(moved) >= needed * (1 - 0x1p-18));
    REQUIRE(std::fabs(moved) <= needed * (1 + 0x1p-18));
    const double along = x * away[0] + y * away[1] + z * away[2];
    if (std::fabs(along) > 1e-3 * size) REQUIRE((moved > 0) == (along > 0));
  }
}
