// Observers of a traversal see every event that WorkCounter counts, in a consistent order, and change nothing.

#include <tests/traversal/instances/moving_scenes.h>

#include <hiprt_build/format/view.h>
#include <hiprt_device/format/layout.h>

#include <set>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261122;

/// Checks each step against the last ones.
struct Watcher : WorkCounter {
  unsigned nodes = 0, leaves = 0, candidates = 0, entered = 0, left = 0;
  float nearest = std::numeric_limits<float>::infinity();
  bool in_leaf = false;

  void on_node(const NodeVisit& visit) {
    REQUIRE(is_box(visit.node));
    for (unsigned i = 0; i < kBranching; ++i)
      if (visit.met[i]) REQUIRE(visit.enter[i] >= 0.0f);
    ++nodes;
    in_leaf = false;
  }
  void on_leaf_at(const std::byte*, NodeRef leaf) {
    REQUIRE_FALSE(is_box(leaf));
    ++leaves;
    in_leaf = true;
  }
  void on_candidate(unsigned slot, float t) {
    REQUIRE(in_leaf);
    REQUIRE(slot < 2);
    if (t >= 0.0f) nearest = std::min(nearest, t);
    ++candidates;
  }
  void on_enter(std::uint32_t) {
    REQUIRE(in_leaf);
    ++entered;
    in_leaf = false;
  }
  void on_exit() {
    REQUIRE(left < entered);
    ++left;
    in_leaf = false;
  }
};
static_assert(TraversalObserver<Watcher> && !TraversalObserver<WorkCounter> && !TraversalObserver<NoCounter>);

template <class LayoutType, class CounterType> struct Counted : WithLayout<LayoutType> { using Counter = CounterType; };
template <class Layout, class Counter> using Tracer = Moving<Instanced<Counted<Layout, Counter>, 2>>;

}  // namespace

TEMPLATE_TEST_CASE("an observer sees the counted work, and changes no hit", "", FloatLayout, PlanesLayout, HalfLayout,
                   QuantizedLayout) {
  Random random(kSeed);
  InstanceScene scene;
  scene.add_file({oracle::icosphere(3)}, TestType::kId);
  for (unsigned level = 0; level < 2; ++level) {
    scene.groups.emplace_back(6);
    for (Instance& instance : scene.groups.back())
      instance = {.object = random.below(1 + level), .to_scene = random_affine(random, 2)};
  }
  scene.groups[1][0].object = 1;
  scene.build();
  using Plain = Tracer<TestType, WorkCounter>;
  using Observed = Tracer<TestType, Watcher>;
  unsigned hits = 0, left = 0;
  for (unsigned i = 0; i < 400; ++i) {
    const auto origin = random.in_cube(8), target = random.in_cube(2);
    Ray ray;
    ray.origin = Vec3(origin[0], origin[1], origin[2]);
    ray.direction = Vec3(target[0], target[1], target[2]) - ray.origin;
    INFO("seed " << kSeed << ", ray " << i);
    WorkCounter counter;
    Watcher watcher;
    typename Plain::Stack::Memory stack;
    const auto expected = closest_hit<Plain>(scene.view(), ray, counter, stack);
    const auto hit = closest_hit<Observed>(scene.view(), ray, watcher, stack);
    REQUIRE((hit.t == expected.t && hit.primitive == expected.primitive && hit.path == expected.path));
    REQUIRE(watcher.box_tests == counter.box_tests);
    REQUIRE(watcher.nodes == counter.box_tests);
    // Layouts that round boxes look at an instance's own before they count it.
    constexpr bool kRounded = TestType::kId == NodeLayout::kHalf || TestType::kId == NodeLayout::kQuantized;
    REQUIRE(watcher.leaves >= counter.leaf_tests + counter.instance_tests);
    REQUIRE((kRounded || watcher.leaves == counter.leaf_tests + counter.instance_tests));
    REQUIRE(watcher.entered <= counter.instance_tests);
    if (hit.found()) {
      ++hits;
      REQUIRE(watcher.nearest == hit.t);
    }
    left += watcher.left;
  }
  CHECK(hits > 100);
  CHECK(left > 100);
}

TEST_CASE("a counter continues from its value") {
  InstanceScene scene;
  scene.add_file({oracle::icosphere(2)}, NodeLayout::kPlanes);
  using P = Counted<PlanesLayout, WorkCounter>;
  const SceneView view = make_scene_view(*open_buffer(std::as_const(scene.files[0]).bytes()));
  const Ray ray{{0.1f, 0.2f, 5}, 0, {0, 0, -1}};
  P::Stack::Memory stack;
  WorkCounter once, twice;
  CHECK(closest_hit<P>(view, ray, once, stack).found());
  CHECK(closest_hit<P>(view, ray, twice, stack).found());
  CHECK(closest_hit<P>(view, ray, twice, stack).found());
  CHECK(once.box_tests > 0);
  CHECK(twice.box_tests == 2 * once.box_tests);
  CHECK(any_hit<P>(view, ray, twice, stack).found());
  CHECK(twice.box_tests > 2 * once.box_tests);
}

TEST_CASE("boxes and triangles before tmin or behind tmax are not tested") {
  // Balls in a row along x, and a ray along the row with a part of its range left.
  std::vector<oracle::Mesh> balls;
  constexpr unsigned kBalls = 64;
  for (unsigned i = 0; i < kBalls; ++i) balls.push_back(oracle::placed(oracle::icosphere(2), 0.4, {1.0 * i, 0, 0}));
  const auto bvh = build::build(oracle::views(balls), {.nodes = NodeLayout::kPlanes});
  REQUIRE(bvh.has_value());
  const SceneView view = make_scene_view(*open_buffer(bvh->buffer.bytes()));
  using P = Counted<PlanesLayout, WorkCounter>;
  const auto work = [&](float tmin, float tmax) {
    const Ray ray{.origin = {-5, 0.01f, 0.02f}, .tmin = tmin, .direction = {1, 0, 0}, .tmax = tmax};
    P::Stack::Memory memory;
    AllHits<P> query(view, ray, {memory});
    unsigned hits = 0;
    while (query.next_hit().found()) ++hits;
    CHECK(hits >= 2);
    return query.counter();
  };
  constexpr float kEnd = 5.0f + kBalls;
  const WorkCounter all = work(0, kEnd);
  for (const WorkCounter& part : {work(kEnd - 2.5f, kEnd), work(0, 6.5f)}) {
    CHECK(part.leaf_tests * 8 < all.leaf_tests);
    CHECK(part.triangle_tests * 8 < all.triangle_tests);
    CHECK(part.box_tests * 4 < all.box_tests);
  }
}
