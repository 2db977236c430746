// Closest points of scenes with custom primitives: every triangle, sphere, curve and functor tried.

#include <hiprt_device/primitives/scene_shapes.h>
#include <hiprt_device/query/double_rays.h>
#include <hiprt_device/query/inside.h>
#include <hiprt_device/query/overlaps.h>
#include <hiprt_device/traverse/stacks/restart.h>
#include <tests/oracle/round_cone_distance.h>
#include <tests/traversal/customs/shape_scenes.h>
#include <tests/traversal/points/custom_points.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20271128;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

template <class P>
ClosestPointOf<typename P::Real, P::kLevels> nearest_of(const SceneView& scene, const NearWorld& world,
                                                        const BasicPointQuery<typename P::Real>& query) {
  typename P::Stack::Memory memory;
  return closest_point<P>(scene, query, typename P::Stack::Storage(memory), world.shapes());
}

template <class Real = float> BasicPointQuery<Real> random_query(Random& random, double size) {
  BasicPointQuery<Real> query;
  query.point = BasicVec3<Real>(vec3(random.in_cube(size * random.log_uniform(0.3, 5))));
  query.time = random.uniform_float(-0.5, 1.5);
  if (random.below(3) == 0) query.mask = 1u << random.below(3);
  if (random.below(3) == 0) query.max_distance = static_cast<Real>(size * random.log_uniform(1e-2, 2));
  return query;
}

std::vector<Scene> scenes_of(const NearWorld& world) {
  std::vector<Scene> scenes;
  for (const auto builder : {build::Builder::kHploc, build::Builder::kLbvh, build::Builder::kSah})
    for (const auto nodes : {NodeLayout::kPlanes, NodeLayout::kQuantized})
      scenes.push_back(world.world.scene({.builder = builder, .nodes = nodes}));
  scenes.push_back(world.world.scene({.nodes = NodeLayout::kFloat, .max_leaf_triangles = 8}));
  scenes.push_back(world.world.scene({.builder = oracle::kEmbreeHigh, .nodes = NodeLayout::kHalf}));
  return scenes;
}

struct Trail : Policies {
  using Stack = RestartStack<2>;
};
struct NoCustom : Policies {
  static constexpr FeatureMask kFeatures = Policies::kFeatures & ~feature_bit(Feature::kCustom);
};

}  // namespace

TEST_CASE("the closest of triangles and custom primitives is that of trying all, in every tree") {
  unsigned of_kind[6] = {};
  for (const double size : {1.0, 1e-6, 1e6}) {
    const NearWorld world(kSeed, size);
    const std::vector<Scene> scenes = scenes_of(world);
    Random random(kSeed);
    for (unsigned i = 0; i < trials(2000); ++i) {
      const PointQuery query = random_query(random, size);
      const auto all = try_all(world, query);
      const ClosestPoint expected = all.empty() ? ClosestPoint{} : all[0];
      if (expected.found()) ++of_kind[expected.geometry];
      INFO("size " << size << ", seed " << kSeed << ", point " << i << ": expected " << text(expected));
      for (const Scene& scene : scenes)
        with_policies(scene, [&](auto policies) {
          const ClosestPoint found = nearest_of<decltype(policies)>(scene.traced, world, query);
          INFO(scene.name << ": found " << text(found));
          REQUIRE(same_point(found, expected));
        });
    }
  }
  for (unsigned kind = 0; kind < 5; ++kind) CHECK(of_kind[kind] > 0);
}

TEST_CASE("custom primitives in double, with a restart trail, and from far away") {
  const NearWorld world(kSeed + 1);
  const Scene scene = world.world.scene({});
  Random random(kSeed + 1);
  for (unsigned i = 0; i < trials(2000); ++i) {
    PointQuery query = random_query(random, 1.0);
    if (i % 5 == 0) query.point *= 1e15f;
    const auto all = try_all(world, query);
    typename Trail::Stack::Storage storage{};
    REQUIRE(same_point(closest_point<Trail>(scene.traced, query, storage, world.shapes()),
                       all.empty() ? ClosestPoint{} : all[0]));
    const PointQueryD wide{Vec3D(query.point) * (1.0 + 1e-13), double{query.max_distance}, query.mask, query.time};
    const auto all_wide = try_all(world, wide);
    REQUIRE(same_point(nearest_of<DoubleRays<>>(scene.traced, world, wide),
                       all_wide.empty() ? ClosestPointD{} : all_wide[0]));
  }
}

TEST_CASE("custom primitives come in order and once, equal ones by number, and a filter leaves some out") {
  const NearWorld world(kSeed + 2);
  for (const Scene& scene : {world.world.scene({}), world.world.scene({.builder = oracle::kEmbreeHigh})}) {
    const PointQuery query{{0.2f, -0.1f, 0.3f}, 0.8f, 0xffffffffu, 0.5f};
    const auto expected = try_all(world, query);
    REQUIRE(expected.size() > 60);
    PrivateStack<>::Memory memory;
    NearestPoint<Policies, NoFilter, NearShapes> points(scene.traced, query, memory, {}, world.shapes());
    for (const ClosestPoint& one : expected) REQUIRE(same_point(points.next_point(), one));
    REQUIRE((!points.next_point().found() && points.state() == TraversalState::kFinished));
    std::vector<ClosestPoint> some(expected.size() + 5);
    for (const std::uint32_t most : {1u, 7u, static_cast<std::uint32_t>(some.size())}) {
      const FoundCount found =
          nearest_points<Policies>(scene.traced, query, some.data(), most, memory, NoFilter{}, world.shapes());
      REQUIRE(found.count == std::min<std::size_t>(most, expected.size()));
      for (std::size_t i = 0; i < found.count; ++i) REQUIRE(same_point(some[i], expected[i]));
    }
    std::vector<ClosestPoint> within;
    const auto take = [&](const ClosestPoint& point) {
      within.push_back(point);
      return true;
    };
    REQUIRE(points_within(scene.traced, query, memory, take, world.shapes()).count == expected.size());
    std::sort(within.begin(), within.end(), [](const auto& a, const auto& b) { return precedes(a, b); });
    for (std::size_t i = 0; i < within.size(); ++i) REQUIRE(same_point(within[i], expected[i]));
    const auto odd = [](const PointQuery&, const ClosestPoint& point) {
      return point.primitive % 2 == 0 ? FilterResult::kReject : FilterResult::kAccept;
    };
    NearestPoint<Policies, decltype(odd), NearShapes> rest(scene.traced, query, memory, odd, world.shapes());
    for (const ClosestPoint& one : expected)
      if (one.primitive % 2 != 0) REQUIRE(same_point(rest.next_point(), one));
    REQUIRE(!rest.next_point().found());
  }
}

TEST_CASE("max_distance counts for custom primitives, and numbers decide ties with triangles") {
  // A triangle and two spheres, all at distance 1 from the origin.
  Mesh mesh;
  mesh.positions = {{-1, -1, -1}, {1, -1, -1}, {0, 2, -1}};
  mesh.triangles = {{0, 1, 2}};
  const Sphere spheres[] = {{{0, 0, 2}, 1}, {{3, 0, 0}, 2}};
  CustomWorld world;
  world.meshes = {mesh};
  world.add({SphereSet::bounds(spheres[0]), SphereSet::bounds(spheres[1])}, 0);
  const Scene scene = world.scene({});
  const PrimitiveList<SphereSet> list{SphereSet{spheres}};
  PrivateStack<>::Memory memory;
  const auto at = [&](const Vec3& point, float far) {
    return closest_point<Policies>(scene.traced, PointQuery{point, far}, memory, list);
  };
  REQUIRE((at(Vec3(0), 1).geometry == 0 && at(Vec3(0), 1).distance() == 1.0f));
  REQUIRE(!at(Vec3(0), std::nextafter(1.0f, 0.0f)).found());
  ClosestPoint all[4];
  REQUIRE(nearest_points<Policies>(scene.traced, {}, all, 4, memory, NoFilter{}, list).count == 3);
  REQUIRE((all[1].geometry == 1 && all[1].primitive == 0 && all[2].geometry == 1 && all[2].primitive == 1));
  REQUIRE((at(Vec3(0, 0, 2), kInfinity).distance() == 1.0f && at(Vec3(0, 0, 2), 0.5f).distance() == kInfinity));
}

TEST_CASE("scenes with custom primitives are refused by queries without functors") {
  const NearWorld world(kSeed + 3);
  const Scene scene = world.world.scene({});
  PrivateStack<>::Memory memory;
  REQUIRE(closest_point(scene.traced, Vec3(0)).failed());
  REQUIRE(closest_point<Policies>(scene.traced, {}, memory, SceneShapes(scene.traced)).failed());  // No shapes in it.
  ClosestPoint one;
  REQUIRE(nearest_points<Policies>(scene.traced, {}, &one, 1, memory).failed());
  REQUIRE(points_within(scene.traced, {}, memory, [](const ClosestPoint&) { return true; }).failed());
  REQUIRE((is_inside(scene.traced, Vec3(0)) == Side::kUnknown && signed_distance(scene.traced, Vec3(0)).failed()));
  const auto take = [](const BasicOverlap<0>&) { return true; };
  REQUIRE(overlaps(scene.traced, Box{{0, 0, 0}, {1, 1, 1}}, memory, take).failed());
  REQUIRE(closest_point<NoCustom>(scene.traced, {}, memory, world.shapes()).failed());
}

TEST_CASE("the shapes of a file are near without anything else") {
  const ShapeObject object(kSeed + 4, 30);
  const build::Buffer file = object.build(NodeLayout::kPlanes, build::Builder::kHploc);
  const SceneView view = make_scene_view(*open_buffer(file.bytes()));
  const SphereSet balls{reinterpret_cast<const Sphere*>(object.balls.data())};
  const RoundCurveSet curves{object.axes.data(), object.segments.data()};
  Random random(kSeed + 4);
  unsigned of_kind[3] = {};
  for (unsigned i = 0; i < trials(3000); ++i) {
    const PointQuery query{vec3(random.in_cube(random.log_uniform(0.2, 5)))};
    const PointInObject at{Vec3D(query.point), std::numeric_limits<double>::infinity(), 0};
    ClosestPoint expected = try_all(std::vector<Mesh>{object.mesh}, query)[0];
    const auto take = [&](std::uint32_t geometry, std::size_t count, const auto& set) {
      for (std::uint32_t k = 0; k < count; ++k) {
        const auto one = to_result<ClosestPoint>(at.point, PlacedVertices<0>{}, geometry, k, set.closest(at, k));
        if (precedes(one, expected)) expected = one;
      }
    };
    take(1, object.segments.size(), curves);
    take(2, object.balls.size(), balls);
    ++of_kind[expected.geometry];
    PrivateStack<>::Memory memory;
    INFO("seed " << kSeed + 4 << ", point " << i << ": expected " << text(expected));
    REQUIRE(same_point(closest_point<Policies>(view, query, memory, SceneShapes(view)), expected));
  }
  for (const unsigned count : of_kind) CHECK(count > 0);
}
