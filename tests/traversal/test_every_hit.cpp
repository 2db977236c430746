// Queries that continue after a hit, against brute force: ClosestHit in order, AnyHit and AllHits in any order.

#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_device/traverse/stacks/restart.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/every_hit.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/workers.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 4101;

/// Meshes with hits at equal t, copies, triangles that share everything, and such that a builder splits.
struct Case {
  const char* name;
  std::vector<Mesh> meshes;
};

std::vector<Case> cases() {
  std::vector<Case> result;
  result.push_back({"soup", {soup(300, 0.8, kSeed)}});
  result.push_back({"needles", {needles(200, 50, kSeed), needles(100, 1e6, kSeed + 1)}});
  result.push_back({"twice the same", {star(1, 9), star(1, 9)}});
  result.push_back({"copies", {identical(40)}});
  result.push_back({"planes", {grid_plane(5, 2, 0.25f), grid_plane(5, 2, 0.25f), grid_plane(4, 2, 0.5f)}});
  result.push_back({"torture", {torture(150, kSeed)}});
  std::vector<Mesh> masked{soup(150, 0.8, kSeed + 2), soup(150, 0.8, kSeed + 3), soup(150, 0.8, kSeed + 4)};
  masked[0].mask = 1;
  masked[1].mask = 6;
  result.push_back({"masks", masked});
  return result;
}

/// Random rays, axis rays, rays that start at a vertex (t = 0 or -0), and ranges that end exactly at hits.
Ray random_ray(const std::vector<Mesh>& meshes, Random& random) {
  const Mesh& mesh = meshes[random.below(static_cast<std::uint32_t>(meshes.size()))];
  Ray ray{vec3(random.in_cube(1.2)), 0.0f, vec3(random.in_cube(1))};
  if (random.below(4) == 0)
    ray.origin = vec3(mesh.positions[random.below(static_cast<std::uint32_t>(mesh.positions.size()))]);
  if (random.below(4) == 0) {
    const int axis = static_cast<int>(random.below(3));
    for (int k = 0; k < 3; ++k) ray.direction[k] = k == axis ? (random.coin() ? 1.0f : -1.0f) : 0.0f;
  }
  if (random.below(4) == 0) ray.mask = 1u << random.below(4);
  if (!is_traceable(ray)) return ray;
  const std::vector<Hit> hits = every_hit(meshes, ray);
  if (hits.empty()) return ray;
  const auto some_t = [&] { return hits[random.below(static_cast<std::uint32_t>(hits.size()))].t; };
  if (random.below(4) == 0) ray.tmin = some_t();
  if (random.below(4) == 0) ray.tmax = some_t();
  return ray;
}

template <class P>
void check_policies(const char* name, const std::vector<Mesh>& meshes, const Scene& scene, unsigned rays) {
  Random random(kSeed);
  std::size_t hits = 0;
  for (unsigned i = 0; i < rays; ++i) {
    const Ray ray = random_ray(meshes, random);
    const std::vector<Hit> expected = every_hit(meshes, ray);
    hits += expected.size();
    const std::string fault = find_fault(Queries<P>{scene.traced}, ray, expected);
    INFO(scene.name << ", " << name << ", seed " << kSeed << ", ray " << i << "\n" << describe(ray));
    REQUIRE(fault == "");
  }
  CHECK(hits >= rays / 5);
}

}  // namespace

TEST_CASE("queries continue after their hits: all builders and layouts", "[queries]") {
  for (const Case& test : cases()) {
    CAPTURE(test.name);
    for (const NodeLayout layout :
         {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized}) {
      // Planes of 1e18 are beyond half, and 2^126 beyond quantized, which refuses them.
      if (std::string(test.name) == "torture" && layout == NodeLayout::kQuantized) continue;
      for (const build::Builder builder : typical_builders()) {
        const Scene scene = make_scene(test.meshes, {.builder = builder, .nodes = layout});
        dispatch_layout(
            layout, [&](auto tag) { check_policies<Tried<decltype(tag)>>("layout", test.meshes, scene, trials(400)); });
      }
    }
  }
}

TEST_CASE("queries continue after their hits: schedules, lanes and stacks", "[queries]") {
  for (const Case& test : cases()) {
    CAPTURE(test.name);
    for (const build::Builder builder : {build::Builder::kSah, oracle::kEmbreeHigh})
      for (const unsigned leaf : {1u, 8u}) {
        const std::vector<Mesh>& meshes = test.meshes;
        const Scene scene = make_scene(meshes, {.builder = builder, .max_leaf_triangles = leaf});
        const unsigned rays = trials(300);
        check_policies<Tried<PlanesLayout, Immediate, ArrayLanes>>("array lanes", meshes, scene, rays);
        check_policies<Tried<PlanesLayout, Postponed>>("postponed", meshes, scene, rays);
        check_policies<Tried<PlanesLayout, Postponed, ArrayLanes>>("postponed, array lanes", meshes, scene, rays);
        using Held = Tried<PlanesLayout, Immediate, DefaultLanes, RestartStack<2>>;
        check_policies<Held>("restart", meshes, scene, rays);
        check_policies<Tried<PlanesLayout, Postponed, ArrayLanes, RestartStack<0>>>("restart 0", meshes, scene, rays);
      }
  }
}

TEST_CASE("split needles: AnyHit and kRepeat may repeat hits, AllHits does not", "[queries]") {
  const std::vector<Mesh> meshes{needles(300, 50, kSeed)};
  const Scene scene = make_scene(meshes, {.builder = oracle::kEmbreeHigh});
  REQUIRE(is_split(scene.traced));
  Random random(kSeed);
  std::size_t once = 0, repeated = 0, any = 0;
  const Queries<Tried<PlanesLayout>> queries{scene.traced};
  for (unsigned i = 0; i < 500; ++i) {
    const Ray ray = random_ray(meshes, random);
    once += queries.all(ray).hits.size();
    repeated += queries.all<SplitPrimitives::kRepeat>(ray).hits.size();
    any += queries.any(ray).hits.size();
  }
  INFO("seed " << kSeed);
  CHECK(once > 0);
  CHECK(repeated > once);
  CHECK(any == repeated);
}

TEST_CASE("all hits of a scene without splits take one traversal", "[queries]") {
  const std::vector<Mesh> meshes{soup(5000, 0.3, kSeed)};
  const Scene scene = make_scene(meshes, {.builder = build::Builder::kSah});
  REQUIRE_FALSE(is_split(scene.traced));
  struct RejectAll {
    FilterResult operator()(const Ray&, const Hit&) const { return FilterResult::kReject; }
  };
  using P = Tried<PlanesLayout>;
  Random random(kSeed);
  std::uint64_t all = 0, closest = 0;
  std::size_t hits = 0;
  for (unsigned i = 0; i < trials(1000); ++i) {
    const Ray ray = random_ray(meshes, random);
    INFO("seed " << kSeed << ", ray " << i << "\n" << describe(ray));
    // Whoever rejects every hit visits all nodes that the ray meets, each once.
    const WorkCounter whole = Queries<P, RejectAll>{scene.traced}.any(ray).work;
    const Drained found = Queries<P>{scene.traced}.all(ray);
    REQUIRE(found.work.box_tests == whole.box_tests);
    // A record at whose hit the query stops is tested again from that hit on.
    REQUIRE(found.work.leaf_tests == whole.leaf_tests + found.hits.size());
    hits += found.hits.size();
    all += found.work.box_tests;
    closest += Queries<P>{scene.traced}.closest(ray).work.box_tests;
  }
  CHECK(hits > trials(1000));
  CHECK(closest > 2 * all);
}

namespace {

template <class Query> void check_refusal(const SceneView& scene) {
  PrivateStack<>::Memory memory;
  Query query(scene, Ray{Vec3(0, 0, -1), 0, Vec3(0, 0, 1)}, memory);
  CHECK(query.state() == TraversalState::kRefused);
  for (int again = 0; again < 3; ++again) {
    const Hit hit = query.next_hit();
    CHECK(hit.failed());
    CHECK_FALSE(hit.found());
    CHECK(query.state() == TraversalState::kRefused);
  }
  CHECK(query.counter().box_tests + query.counter().leaf_tests == 0);
}

template <class P> void check_refusals(const SceneView& scene) {
  CHECK_FALSE(covers<P>(scene));
  check_refusal<ClosestHit<P>>(scene);
  check_refusal<AnyHit<P>>(scene);
  check_refusal<AllHits<P>>(scene);
  check_refusal<AllHits<P, NoFilter, NoPrimitives, SplitPrimitives::kRepeat>>(scene);
}

}  // namespace

TEST_CASE("queries whose policies do not cover a scene refuse it", "[queries]") {
  constexpr FeatureMask kUnsplit = kKnownFeatures & ~feature_bit(Feature::kSplitReferences);
  using NoSplits = Tried<PlanesLayout, Immediate, DefaultLanes, PrivateStack<>, kUnsplit>;
  using NoMasks =
      Tried<PlanesLayout, Immediate, DefaultLanes, PrivateStack<>, kUnsplit & ~feature_bit(Feature::kMasks)>;
  const std::vector<Mesh> meshes{needles(300, 50, kSeed)};
  const Scene split = make_scene(meshes, {.builder = oracle::kEmbreeHigh}),
              whole = make_scene(meshes, {.builder = build::Builder::kSah});
  REQUIRE(is_split(split.traced));
  check_refusals<NoSplits>(split.traced);
  check_refusals<Tried<FloatLayout>>(whole.traced);
  check_refusals<Tried<QuantizedLayout>>(whole.traced);
  CHECK(covers<NoSplits>(whole.traced));
  CHECK(covers<NoMasks>(whole.traced));
  check_policies<NoSplits>("no splits", meshes, whole, trials(200));
  check_policies<NoMasks>("no masks", meshes, whole, trials(200));
  std::vector<Mesh> masked = meshes;
  masked[0].mask = 2;
  check_refusals<NoMasks>(make_scene(masked).traced);
}

TEST_CASE("the states of a query with two hits", "[queries]") {
  const std::vector<Mesh> meshes{grid_plane(1, 2, 1), grid_plane(1, 2, 2)};
  const Scene scene = make_scene(meshes);
  using P = Tried<PlanesLayout>;
  PrivateStack<>::Memory memory;
  ClosestHit<P> query(scene.traced, Ray{Vec3(0.25f, 0.5f, 0), 0, Vec3(0, 0, 1)}, memory);
  CHECK(query.state() == TraversalState::kInit);
  CHECK_FALSE(query.hit().found());
  for (const float t : {1.0f, 2.0f}) {
    const Hit hit = query.next_hit();
    CHECK(hit.t == t);
    CHECK(same_hit(query.hit(), hit));
    CHECK(query.state() == TraversalState::kHit);
  }
  for (int again = 0; again < 3; ++again) {
    CHECK(same_hit(query.next_hit(), Hit{}));
    CHECK(query.state() == TraversalState::kFinished);
    CHECK(same_hit(query.hit(), Hit{}));
  }
}
