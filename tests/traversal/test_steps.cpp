// Single steps of queries: the exact room of stacks, nodes that are popped and not visited, and how far a spawned ray
// moves.

#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/traverse/stacks/rolling.h>
#include <hiprt_device/traverse/stacks/shared.h>
#include <tests/oracle/random.h>
#include <tests/traversal/chain.h>

#include <tests/catch.h>

#include <cmath>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

/// Pushes until the stack says that it is full: there is room for kMostPushed more iff they fit.
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
}

struct Counting : Policies {
  using Counter = WorkCounter;
};

}  // namespace

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
