// Custom primitives through builder and traversal: types, lists, tables, masks, filters, several hits per primitive,
// and the values that a functor may report.

#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_device/traverse/stacks/restart.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/customs/custom_shapes.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/workers.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 6311;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr NodeLayout kLayouts[] = {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized};

using Shapes = PrimitiveList<BoxSurface, MiddlePlane, BoxSurface>;

/// Two meshes, and customs of the three types of Shapes and of one that it does not have.
CustomWorld mixed_world() {
  CustomWorld world;
  world.meshes = {placed(soup(100, 0.8, kSeed), 32), placed(soup(50, 0.8, kSeed + 1), 32)};
  world.meshes[1].mask = 2;
  world.add(integer_boxes(200, kSeed + 2), 0);
  world.add(integer_boxes(200, kSeed + 3), 1);
  world.add(integer_boxes(200, kSeed + 4), 2, 5);
  world.add(integer_boxes(100, kSeed + 5), 200);
  world.add(integer_boxes(100, kSeed + 6), 1, 2);
  return world;
}

Shapes shapes_of(const CustomWorld& world) {
  return {{world.boxes[0]}, {world.boxes_of_geometry}, {world.boxes[2], false}};
}

struct Count {
  std::size_t hits = 0, twice = 0;  ///< twice: entry and exit at one t.
};

template <class P, class Primitives>
Count check_world(const CustomWorld& world, const Scene& scene, const Primitives& primitives, unsigned rays) {
  Random random(kSeed);
  Count count;
  for (unsigned i = 0; i < rays; ++i) {
    const Ray ray = integer_ray(random);
    const std::vector<Hit> expected = world.every_hit(ray, primitives);
    INFO(scene.name << ", seed " << kSeed << ", ray " << i << "\n" << describe(ray));
    REQUIRE(find_fault(Queries<P, NoFilter, Primitives>{scene.traced, {}, primitives}, ray, expected) == "");
    count.hits += expected.size();
    count.twice += expected.size() - unique(expected).size();
  }
  return count;
}

/// Whether there is a hit of the geometry among those of random rays.
template <class Primitives>
bool is_ever_hit(const CustomWorld& world, const Primitives& primitives, unsigned geometry) {
  Random random(kSeed);
  for (unsigned i = 0; i < 1000; ++i)
    for (const Hit& hit : world.every_hit(integer_ray(random), primitives))
      if (hit.geometry == geometry) return true;
  return false;
}

}  // namespace

TEST_CASE("custom primitives of several types among triangles: every builder and layout", "[custom]") {
  const CustomWorld world = mixed_world();
  const Shapes shapes = shapes_of(world);
  for (const unsigned geometry : {0u, 1u, 2u, 3u, 4u, 6u}) CHECK(is_ever_hit(world, shapes, geometry));
  CHECK_FALSE(is_ever_hit(world, shapes, 5));  // Of a type that the list does not have.
  for (const NodeLayout layout : kLayouts)
    for (const build::Builder builder : typical_builders())
      for (const unsigned leaf : {1u, 8u}) {
        const Scene scene = world.scene({.builder = builder, .nodes = layout, .max_leaf_triangles = leaf});
        dispatch_layout(layout, [&](auto tag) {
          const Count count = check_world<Tried<decltype(tag)>>(world, scene, shapes, trials(200));
          CHECK(count.hits > trials(200) * 2);
          CHECK(count.twice > 0);
        });
      }
}

TEST_CASE("custom primitives under other schedules, lanes and stacks", "[custom]") {
  const CustomWorld world = mixed_world();
  const Shapes shapes = shapes_of(world);
  const Scene scene = world.scene({});
  const unsigned rays = trials(500);
  check_world<Tried<PlanesLayout, Immediate, ArrayLanes>>(world, scene, shapes, rays);
  check_world<Tried<PlanesLayout, Postponed>>(world, scene, shapes, rays);
  check_world<Tried<PlanesLayout, Postponed, ArrayLanes, RestartStack<0>>>(world, scene, shapes, rays);
  check_world<Tried<PlanesLayout, Immediate, DefaultLanes, RestartStack<2>>>(world, scene, shapes, rays);
}

TEST_CASE("a table has a row of custom primitives per ray type", "[custom]") {
  const CustomWorld world = mixed_world();
  using Table = PrimitiveTable<Shapes, PrimitiveList<MiddlePlane>>;
  const Table table{shapes_of(world), MiddlePlane{world.boxes_of_geometry, false}};
  const Scene scene = world.scene({});
  std::size_t hits[3] = {};
  for (const unsigned ray_type : {0u, 1u, 2u}) {
    const TableRow<Table> row{table, ray_type};
    hits[ray_type] = check_world<Tried<PlanesLayout>>(world, scene, row, trials(300)).hits;
  }
  // Rays of type 1 meet the first geometry only, as planes; those of type 2, which has no row, triangles only.
  CHECK(is_ever_hit(world, TableRow<Table>{table, 1}, 2));
  for (const unsigned geometry : {3u, 4u, 6u}) CHECK_FALSE(is_ever_hit(world, TableRow<Table>{table, 1}, geometry));
  for (const unsigned geometry : {2u, 3u, 4u, 6u}) CHECK_FALSE(is_ever_hit(world, TableRow<Table>{table, 2}, geometry));
  CHECK(is_ever_hit(world, TableRow<Table>{table, 2}, 0));
  CHECK(hits[0] > hits[1]);
  CHECK(hits[1] > hits[2]);
}

TEST_CASE("reports of a functor outside the range, or with NaN, are discarded", "[custom]") {
  for (const float odd : {std::numeric_limits<float>::quiet_NaN(), kInfinity, -kInfinity, -1000.0f, 1e9f}) {
    CustomWorld world;
    world.add(integer_boxes(300, kSeed + 7), 0);
    const PrimitiveList<BoxSurface> shapes{{world.boxes[0], true, odd}};
    const Scene scene = world.scene({});
    CAPTURE(odd);
    Random random(kSeed + 8);
    unsigned found = 0;
    for (unsigned i = 0; i < trials(500); ++i) {
      Ray ray = integer_ray(random);
      if (!(ray.tmax < kInfinity)) ray.tmax = 100;
      const std::vector<Hit> expected = world.every_hit(ray, shapes);
      INFO("seed " << kSeed + 8 << ", ray " << i << "\n" << describe(ray));
      REQUIRE(std::none_of(expected.begin(), expected.end(), [](const Hit& hit) { return hit.primitive % 2 == 1; }));
      using P = Tried<PlanesLayout>;
      REQUIRE(find_fault(Queries<P, NoFilter, PrimitiveList<BoxSurface>>{scene.traced, {}, shapes}, ray, expected) ==
              "");
      found += expected.empty() ? 0 : 1;
    }
    CHECK(found > trials(500) / 10);
  }
}

TEST_CASE("one box: entry and exit, in every layout", "[custom]") {
  CustomWorld world;
  world.add({Box{{-1, -1, 2}, {1, 1, 4}}}, 0);
  const PrimitiveList shapes{BoxSurface{world.boxes[0]}};
  for (const NodeLayout layout : kLayouts) {
    const Scene scene = world.scene({.nodes = layout});
    dispatch_layout(layout, [&](auto tag) {
      using P = Tried<decltype(tag)>;
      const Queries<P, NoFilter, PrimitiveList<BoxSurface>> queries{scene.traced, {}, shapes};
      const Ray ray{Vec3(0, 0, 0), 0.0f, Vec3(0, 0, 0.5f)};
      for (const Drained& drained : {queries.closest(ray), queries.any(ray), queries.all(ray)}) {
        REQUIRE(drained.hits.size() == 2);
        CHECK(drained.hits[0].t == 4);
        CHECK(drained.hits[1].t == 8);
        CHECK(drained.hits[0].u == 0.25f);
        CHECK(drained.hits[0].normal == Vec3(0, 0, -1));
        CHECK(drained.hits[1].normal == Vec3(0, 0, 1));
      }
      // Both ends of the range belong to the ray; between the sides there is nothing.
      CHECK(queries.closest({ray.origin, 4, ray.direction, 8}).hits.size() == 2);
      CHECK(queries.closest({ray.origin, 4.5f, ray.direction, 7.5f}).hits.empty());
      CHECK(queries.all({ray.origin, 4.5f, ray.direction}).hits.size() == 1);
    });
  }
}

TEST_CASE("the filter of a type and the filter of the query both apply", "[custom]") {
  const CustomWorld world = mixed_world();
  const Shapes shapes = shapes_of(world);
  const Scene scene = world.scene({});
  struct EvenOnly {
    FilterResult operator()(const Ray&, const Hit& hit) const {
      return hit.primitive % 2 == 0 ? FilterResult::kAccept : FilterResult::kReject;
    }
  };
  const Queries<Tried<PlanesLayout>, EvenOnly, Shapes> queries{scene.traced, {}, shapes};
  Random random(kSeed + 9);
  std::size_t hits = 0;
  for (unsigned i = 0; i < trials(500); ++i) {
    const Ray ray = integer_ray(random);
    const auto expected = kept(world.every_hit(ray, shapes), [](const Hit& hit) { return hit.primitive % 2 == 0; });
    INFO("seed " << kSeed + 9 << ", ray " << i << "\n" << describe(ray));
    REQUIRE(find_fault(queries, ray, expected) == "");
    hits += expected.size();
  }
  CHECK(hits > trials(500));
}

namespace {

/// Ends the search at every primitive.
struct Stopping : BoxSurface {
  FilterResult filter(const Ray&, const Hit&) const { return FilterResult::kAcceptAndStop; }
};
struct RejectAll {
  FilterResult operator()(const Ray&, const Hit&) const { return FilterResult::kReject; }
};

template <class P, class Primitives>
void check_refused(const SceneView& scene, const Primitives& primitives, const Ray& ray) {
  PrivateStack<>::Memory memory;
  ClosestHit<P, NoFilter, Primitives> closest(scene, ray, memory, {}, primitives);
  AnyHit<P, NoFilter, Primitives> any(scene, ray, memory, {}, primitives);
  AllHits<P, NoFilter, Primitives> all(scene, ray, memory, {}, primitives);
  CHECK((closest.next_hit().failed() && any.next_hit().failed() && all.next_hit().failed()));
  for (const TraversalState state : {closest.state(), any.state(), all.state()})
    CHECK(state == TraversalState::kRefused);
}

}  // namespace

TEST_CASE("a type's filter can stop the search, unless the query's rejects the hit", "[custom]") {
  CustomWorld world;
  world.add({Box{{-1, -1, 2}, {1, 1, 4}}, Box{{-1, -1, 6}, {1, 1, 8}}}, 0);
  const PrimitiveList<Stopping> shapes{Stopping{{world.boxes[0]}}};
  const Scene scene = world.scene({});
  const Ray ray{Vec3(0, 0, 0), 0.0f, Vec3(0, 0, 1)};
  using P = Tried<PlanesLayout>;
  const Queries<P, NoFilter, PrimitiveList<Stopping>> queries{scene.traced, {}, shapes};
  for (const Drained& drained : {queries.closest(ray), queries.any(ray), queries.all(ray)}) {
    CHECK(drained.wrong == "");
    CHECK(drained.hits.size() == 1);
  }
  const Queries<P, RejectAll, PrimitiveList<Stopping>> reject{scene.traced, {}, shapes};
  CHECK(reject.closest(ray).hits.empty());
  CHECK(reject.any(ray).hits.empty());
}

TEST_CASE("scenes with custom primitives are refused by queries without them", "[custom]") {
  const CustomWorld world = mixed_world();
  const Ray ray{Vec3(0, 0, -40), 0.0f, Vec3(0, 0, 1)};
  for (const NodeLayout layout : kLayouts) {
    const Scene scene = world.scene({.nodes = layout});
    dispatch_layout(layout, [&](auto tag) {
      check_refused<WithLayout<decltype(tag)>>(scene.traced, NoPrimitives{}, ray);
      CHECK(closest_hit(scene.traced, ray).failed());
      CHECK(any_hit(scene.traced, ray).failed());
    });
  }
  // And by policies without the feature, even with primitives.
  constexpr FeatureMask kNoCustom = kKnownFeatures & ~feature_bit(Feature::kCustom);
  using P = Tried<PlanesLayout, Immediate, DefaultLanes, PrivateStack<>, kNoCustom>;
  check_refused<P>(world.scene({}).traced, shapes_of(world), ray);
}
