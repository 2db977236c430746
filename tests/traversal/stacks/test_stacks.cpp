// Every stack gives the hits of a large stack, or reports that it was too small.

#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/traverse/stacks/restart.h>
#include <hiprt_device/traverse/stacks/rolling.h>
#include <hiprt_device/traverse/stacks/shared.h>
#include <hiprt_device/traverse/stacks/tiered.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/chain.h>
#include <tests/traversal/scenes.h>
#include <tests/traversal/tracers.h>
#include <tests/traversal/workers.h>

#include <tests/catch.h>
#include <limits>
#include <type_traits>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr unsigned kThreads = 3;
constexpr std::uint64_t kSeed = 78;
constexpr StackEntry kUntouched = 0xfeedfeedfeedfeedu;

template <class StackPolicy, class LanesPolicy, class SchedulePolicy> struct With : Policies {
  using Stack = StackPolicy;
  using Lanes = LanesPolicy;
  using Schedule = SchedulePolicy;
};

/// Memory for kThreads stacks and a count of overflows. Only thread 1's stack is used.
struct ThreadStacks {
  std::vector<StackEntry> block = std::vector<StackEntry>(kThreads * 64, kUntouched);
  std::vector<StackEntry> global = std::vector<StackEntry>(kThreads * 256, kUntouched);
  std::vector<StackEntry> own = std::vector<StackEntry>(256);  ///< Of thread 1.
  std::uint32_t overflows = 0;

  /// @pre entries were StackEntry: NodeRefs lie closer together.
  void check_neighbours() const {
    for (std::size_t i = 0; i < block.size(); ++i)
      if (i % kThreads != 1) REQUIRE(block[i] == kUntouched);
    for (std::size_t i = 0; i < global.size(); ++i)
      if (i % kThreads != 1) REQUIRE(global[i] == kUntouched);
  }
};

template <unsigned N> auto storage(SharedStack<N>, ThreadStacks& stacks, std::uint32_t) {
  return typename SharedStack<N>::Storage(stacks.block.data(), 1, kThreads, &stacks.overflows);
}
template <unsigned N, unsigned M> auto storage(TieredStack<N, M>, ThreadStacks& stacks, std::uint32_t) {
  using Stack = TieredStack<N, M>;
  typename Stack::Memory own;
  typename Stack::Storage made(stacks.block.data(), 1, kThreads, own, &stacks.overflows);
  made.own = reinterpret_cast<std::byte*>(stacks.own.data());
  return made;
}
template <unsigned N> auto storage(RollingStack<N>, ThreadStacks& stacks, std::uint32_t capacity) {
  return typename RollingStack<N>::Storage(stacks.block.data(), 1, kThreads,
                                           grid_spill(stacks.global.data(), kThreads, capacity, 1), &stacks.overflows);
}
auto storage(GlobalStack, ThreadStacks& stacks, std::uint32_t capacity) {
  return GlobalStack::Storage(grid_spill(stacks.global.data(), kThreads, capacity, 1), &stacks.overflows);
}
template <unsigned N> auto storage(RestartStack<N>, ThreadStacks& stacks, std::uint32_t) {
  typename RestartStack<N>::Storage made;
  made.overflowed_rays = &stacks.overflows;
  return made;
}

/// Random rays, and rays from inside many boxes (equal entry distances).
Ray random_ray(Random& random) {
  const bool inside = random.below(2) == 0;
  return {vec3(random.in_cube(inside ? 0.3 : 1.5)), 0.0f, vec3(random.in_cube(1))};
}

template <class P> void check_same_hits(const Scene& scene, std::uint32_t capacity) {
  ThreadStacks stacks, any_stacks;
  Random random(kSeed);
  for (unsigned i = 0; i < trials(3000); ++i) {
    const Ray ray = random_ray(random);
    const Hit expected = default_tracer().closest(scene, ray);
    REQUIRE(same_hit(closest_hit<P>(scene.traced, ray, storage(typename P::Stack{}, stacks, capacity)), expected));
    const auto any_storage = storage(typename P::Stack{}, any_stacks, capacity);
    REQUIRE(any_hit<P>(scene.traced, ray, any_storage).found() == expected.found());
  }
  stacks.check_neighbours();
  CHECK(stacks.overflows + any_stacks.overflows == 0);
}

template <class Stack> void check_stack(const Scene& scene, std::uint32_t capacity = 0) {
  check_same_hits<With<Stack, DefaultLanes, Immediate>>(scene, capacity);
  check_same_hits<With<Stack, ArrayLanes, Immediate>>(scene, capacity);
  check_same_hits<With<Stack, DefaultLanes, Postponed>>(scene, capacity);
  check_same_hits<With<Stack, ArrayLanes, Postponed>>(scene, capacity);
}

/// A stack that is too small: any-hit finds only real hits, and reports a failure where it cannot know.
template <class Stack> void check_overflow(const Scene& scene, std::uint32_t capacity = 0) {
  using P = With<Stack, DefaultLanes, Immediate>;
  ThreadStacks stacks, any_stacks;
  Random random(kSeed);
  std::uint32_t failed = 0, any_failed = 0;
  for (unsigned i = 0; i < trials(3000); ++i) {
    const Ray ray = random_ray(random);
    const auto closest_storage = storage(Stack{}, stacks, capacity);
    const Hit expected = default_tracer().closest(scene, ray);
    ClosestHit<P> query(scene.traced, ray, closest_storage);
    const Hit hit = query.next_hit();
    if (hit.failed()) {
      ++failed;
      REQUIRE(query.state() == TraversalState::kStackOverflow);
      REQUIRE(query.next_hit().failed());
    } else {
      REQUIRE(same_hit(hit, expected));
    }
    REQUIRE(stacks.overflows == failed);
    AnyHit<P> any(scene.traced, ray, storage(Stack{}, any_stacks, capacity));
    const Hit some = any.next_hit();
    if (some.failed()) ++any_failed;
    if (!some.failed()) REQUIRE(some.found() == expected.found());
    REQUIRE(any_stacks.overflows == any_failed);
  }
  stacks.check_neighbours();
  CHECK(failed != 0);
}

/// So many triangles overlap that wrong entry distances lose hits of a few rays.
Scene test_scene() { return make_scene({soup(2000, 0.3, kSeed)}, {.max_leaf_triangles = 2}); }

}  // namespace

TEST_CASE("every stack gives the same hits", "[stack]") {
  INFO("seed " << kSeed);
  const Scene scene = test_scene();
  const std::uint32_t bound = scene.traced.stack_bound;
  SECTION("shared") { check_stack<SharedStack<64>>(scene); }
  SECTION("tiered, next to nothing shared") { check_stack<TieredStack<1, 64>>(scene); }
  SECTION("tiered, less shared than a node leaves") { check_stack<TieredStack<2, 64>>(scene); }
  SECTION("tiered") { check_stack<TieredStack<8, 64>>(scene); }
  SECTION("tiered, next to all shared") { check_stack<TieredStack<63, 64>>(scene); }
  SECTION("rolling, small ring") { check_stack<RollingStack<2>>(scene, RollingStack<2>::spill_entries(bound)); }
  SECTION("rolling") { check_stack<RollingStack<8>>(scene, RollingStack<8>::spill_entries(bound)); }
  SECTION("global") { check_stack<GlobalStack>(scene, bound + kMostPushed); }
  SECTION("restart, nothing held") { check_stack<RestartStack<0>>(scene); }
  SECTION("restart, one held") { check_stack<RestartStack<1>>(scene); }
  SECTION("restart") { check_stack<RestartStack<4>>(scene); }
  SECTION("restart, most held") { check_stack<RestartStack<8>>(scene); }
}

TEST_CASE("a stack that is too small reports a failure", "[stack]") {
  INFO("seed " << kSeed);
  const Scene scene = test_scene();
  SECTION("shared") { check_overflow<SharedStack<5>>(scene); }
  SECTION("tiered") { check_overflow<TieredStack<3, 6>>(scene); }
  SECTION("rolling") { check_overflow<RollingStack<4>>(scene, 2); }
  SECTION("global") { check_overflow<GlobalStack>(scene, 6); }
}

namespace {

template <class Entry> Entry entry_of(unsigned i) {
  const NodeRef ref = make_ref(64 * i, NodeType::kBox32);
  if constexpr (std::is_same_v<Entry, NodeRef>)
    return ref;
  else
    return make_entry(static_cast<float>(i), ref);
}

/// @param stack_storage of a stack with a bottom and seven entries.
template <class Stack, class Entry> void check_bottom(const typename Stack::Storage& stack_storage) {
  StackBacktrack<Stack, Entry> backtrack(stack_storage, kInvalidRef);
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float limit : {infinity, 1.0f, 0.0f, -0.0f, std::numeric_limits<float>::quiet_NaN(), -1.0f}) {
    CAPTURE(limit);
    CHECK(backtrack.empty());
    CHECK(backtrack.pop(limit) == kInvalidRef);
    CHECK(backtrack.pop(limit) == kInvalidRef);
    CHECK(backtrack.empty());
  }
  // Full, and empty again.
  for (unsigned round = 0; round < 2; ++round) {
    for (unsigned i = 0; i < 7; ++i) {
      CHECK(backtrack.reserve() == (i + kMostPushed <= 7));
      backtrack.later(entry_of<Entry>(i));
    }
    for (unsigned i = 7; i-- > 0;) CHECK(backtrack.pop(infinity) == entry_ref(entry_of<Entry>(i)));
    CHECK(backtrack.pop(infinity) == kInvalidRef);
  }
  // Some at once, as a node leaves them.
  for (unsigned i = 0; i < 6; i += 3)
    backtrack.later_some([&](auto&& later) {
      for (unsigned k = 0; k < 3; ++k) later(entry_of<Entry>(i + k));
    });
  for (unsigned i = 6; i-- > 0;) CHECK(backtrack.pop(infinity) == entry_ref(entry_of<Entry>(i)));
  CHECK(backtrack.empty());
}

template <unsigned kShared, class Entry> void check_tiered_bottom() {
  CAPTURE(kShared);
  ThreadStacks stacks;
  check_bottom<TieredStack<kShared, 7>, Entry>(storage(TieredStack<kShared, 7>{}, stacks, 0));
}

}  // namespace

TEMPLATE_TEST_CASE("an empty stack with a bottom returns the end at every pop, for any limit", "[stack]", StackEntry,
                   NodeRef) {
  PrivateStack<7>::Memory memory;
  check_bottom<PrivateStack<7>, TestType>(memory);
  check_tiered_bottom<1, TestType>();
  check_tiered_bottom<2, TestType>();
  check_tiered_bottom<4, TestType>();
  check_tiered_bottom<5, TestType>();
  check_tiered_bottom<6, TestType>();
}

TEST_CASE("a private stack that is too small reports a failure", "[stack]") {
  using P = With<PrivateStack<5>, DefaultLanes, Immediate>;
  const Scene scene = test_scene();
  std::uint32_t overflows = 0, failed = 0;
  Random random(kSeed);
  for (unsigned i = 0; i < trials(3000); ++i) {
    const Ray ray = random_ray(random);
    PrivateStack<5>::Memory memory;
    const Hit hit = closest_hit<P>(scene.traced, ray, {memory, &overflows});
    if (hit.failed()) ++failed;
    if (!hit.failed()) REQUIRE(same_hit(hit, default_tracer().closest(scene, ray)));
  }
  CHECK(failed != 0);
  CHECK(overflows == failed);
}

TEST_CASE("a deep tree under a restart stack gives the same hits", "[stack]") {
  // Triangles whose sizes and positions grow by 1.3 make a chain.
  Mesh chain;
  double offset = 1;
  for (int i = 0; i < 60; ++i, offset *= 1.3) {
    const auto first = static_cast<std::uint32_t>(chain.positions.size());
    for (const auto& [x, y] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}})
      chain.positions.push_back({static_cast<float>(offset * (1 + x)), static_cast<float>(offset * (1 + y)), 0.0f});
    chain.triangles.push_back({first, first + 1, first + 2});
  }
  const Scene scene = make_scene({chain}, {.max_leaf_triangles = 1});
  check_stack<RestartStack<2>>(scene);
}

namespace {

/// Each ray of the chain down to its triangle; those too deep for the trail fail and are counted.
template <class Query> void check_too_deep(const Chain& chain) {
  const SceneView scene = chain.view();
  const std::vector<Ray> rays = chain.rays();
  std::uint32_t overflows = 0;
  typename Query::Storage storage;
  storage.overflowed_rays = &overflows;
  for (unsigned i = 0; i < rays.size(); ++i) {
    INFO("ray " << i);
    const bool deep = i >= kTrailLevels;
    Query query(scene, rays[i], storage);
    const Hit hit = query.next_hit();
    REQUIRE(query.state() == (deep ? TraversalState::kStackOverflow : TraversalState::kHit));
    REQUIRE(hit.failed() == deep);
    REQUIRE(hit.primitive == (deep ? kInvalidId : i));
    if (!deep) REQUIRE(hit.t == 0.5f);
    REQUIRE(overflows == (deep ? i - kTrailLevels + 1 : 0));
  }
  CHECK(overflows == rays.size() - kTrailLevels);
}

/// A ray through all triangles: each hit of the trail comes once, then the query reports that deeper hits are missing.
template <class P> void check_cut_off(const Chain& chain) {
  const SceneView scene = chain.view();
  const Ray ray{.origin = {0.25f, 0.25f, -0.5f}};
  AllHits<P> query(scene, ray, {});
  std::vector<unsigned> met(kTrailLevels, 0);
  for (Hit hit = query.next_hit(); hit.found(); hit = query.next_hit()) {
    REQUIRE(hit.primitive < kTrailLevels);
    ++met[hit.primitive];
  }
  CHECK(met == std::vector<unsigned>(kTrailLevels, 1));
  CHECK(query.state() == TraversalState::kStackOverflow);
}

template <unsigned kEntries, class Schedule> void check_trail() {
  using P = With<RestartStack<kEntries>, DefaultLanes, Schedule>;
  const Chain chain(kTrailLevels + 16);
  check_too_deep<ClosestHit<P>>(chain);
  check_too_deep<AnyHit<P>>(chain);
  check_cut_off<P>(chain);
}

}  // namespace

TEST_CASE("a tree too deep for the restart trail reports a failure", "[stack]") {
  SECTION("nothing held") { check_trail<0, Immediate>(); }
  SECTION("two held") { check_trail<2, Immediate>(); }
  SECTION("most held") { check_trail<8, Immediate>(); }
  SECTION("postponed") { check_trail<4, Postponed>(); }
}

TEST_CASE("slots of a pool: each wave has its own slot and releases it", "[stack]") {
  std::vector<std::uint32_t> locks(2, 0);
  std::vector<StackEntry> memory(2 * 8);
  const SpillPool pool{locks.data(), memory.data(), 2, 8};
  CHECK(pool_spill_bytes(2, 8, 1) == memory.size() * sizeof(StackEntry));
  {
    const WaveSlot first(pool, 1), second(pool, 1);
    CHECK(first.spill().first == memory.data() + 8);
    CHECK(second.spill().first == memory.data());
    CHECK(locks == std::vector<std::uint32_t>{1, 1});
  }
  CHECK(locks == std::vector<std::uint32_t>{0, 0});
}
