// Closest points of custom primitives in instances, still and moving: every path tried, and the placed shape's
// distance.

#include <hiprt_device/query/double_rays.h>
#include <tests/oracle/round_cone_distance.h>
#include <tests/traversal/points/custom_points.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20271129;

/// Object 0 has triangles and custom primitives, object 1 is a mesh. Groups have instances of them.
struct NearScene : InstanceScene {
  NearWorld near;
  Mesh mesh = icosphere(1);
  std::vector<std::unique_ptr<build::Motion>> motions;

  NearScene(std::uint64_t seed, NodeLayout layout, unsigned levels, bool moving) : near(seed, 1.0, 12) {
    Random random(seed);
    files.push_back(std::move(near.world.scene({.nodes = layout}).bvh.buffer));
    add_file({mesh}, layout);
    for (unsigned level = 0; level < levels; ++level) {
      std::vector<Instance> group(5);
      for (std::uint32_t i = 0; i < group.size(); ++i) {
        const auto objects = static_cast<std::uint32_t>(files.size() + level);
        group[i].object = i == 0 ? objects - 1 : i == 1 ? 0 : random.below(objects);
        group[i].to_scene = random_affine(random, 3.0);
        if (random.below(6) == 0) group[i].mask = 2;
        if (!moving || random.coin()) continue;
        motions.push_back(std::make_unique<build::Motion>(random_motion(random, MotionKind::kSlerp, 3, 3.0)));
        group[i].motion = motions.back().get();
      }
      groups.push_back(group);
    }
    build();
  }
};

/// Tries every primitive of every path.
template <class P> class TryAll {
 public:
  using Result = ClosestPointOf<typename P::Real, P::kLevels>;
  using Query = BasicPointQuery<typename P::Real>;

  TryAll(const NearScene& scene, const SceneView& view, const Query& query)
      : scene_(scene), view_(view), query_(query) {
    search(scene.groups.size() - 1);
  }
  const Result& best() const { return best_; }

 private:
  void search(std::size_t group) {
    for (std::uint32_t i = 0; i < scene_.groups[group].size(); ++i) {
      const Instance& instance = scene_.groups[group][i];
      if ((instance.mask & query_.mask) == 0) continue;
      path_.instance[path_.depth++] = i;
      if (instance.object >= scene_.files.size())
        search(instance.object - scene_.files.size());
      else
        meet(instance.object);
      path_.instance[--path_.depth] = 0;
    }
  }
  void meet(std::uint32_t object) {
    PlacedVertices<P::kLevels> placed;
    Vec3D point(query_.point);
    follow(view_, path_, query_.time, [&](const InstanceRecord& record, const ObjectRecord&, const MotionRecord*) {
      placed.enter(record);
      point = point_to_object(record, point);
    });
    const auto take = [&](std::uint32_t geometry, std::uint32_t primitive, const auto& it) {
      Result one = to_result<Result>(Vec3D(query_.point), placed, geometry, primitive, it);
      one.path = path_;
      const double farthest = query_.max_distance;
      if (one.distance_squared < std::numeric_limits<double>::infinity() &&
          one.distance_squared <= farthest * farthest && (!best_.found() || precedes(one, best_)))
        best_ = one;
    };
    if (object == 0) return scene_.near.try_all(point, query_.time, query_.mask, take);
    for (std::uint32_t i = 0; i < scene_.mesh.triangles.size(); ++i) take(0, i, corners(scene_.mesh, i));
  }

  const NearScene& scene_;
  const SceneView& view_;
  const Query& query_;
  InstancePath<P::kLevels> path_;
  Result best_;
};

template <class P> void check(const NearScene& scene, std::uint64_t seed, unsigned points) {
  const SceneView view = scene.view();
  Random random(seed);
  unsigned found = 0, customs = 0;
  for (unsigned i = 0; i < trials(points); ++i) {
    BasicPointQuery<typename P::Real> query;
    query.point = BasicVec3<typename P::Real>(vec3(random.in_cube(random.log_uniform(0.5, 20))));
    query.time = random.uniform_float(-2, 3);
    if (random.below(3) == 0) query.mask = 2;
    if (random.coin()) query.max_distance = random.uniform_float(0.1, 5);
    const auto expected = TryAll<P>(scene, view, query).best();
    typename P::Stack::Memory memory;
    const auto near = closest_point<P>(view, query, typename P::Stack::Storage(memory), scene.near.shapes());
    INFO("seed " << seed << ", point " << i << ": expected " << text(expected) << ", found " << text(near));
    REQUIRE(same_point(near, expected));
    REQUIRE(near.path == expected.path);
    found += near.found() ? 1 : 0;
    customs += near.found() && near.geometry >= 2 ? 1 : 0;
  }
  CHECK(found > trials(points) / 3);
  CHECK(customs > trials(points) / 10);
}

/// A point of the unit box for each instance: as high as the instance's own number.
struct Marks {
  template <class Id> CustomPoint closest(const PointInObject& at, const Id& id) const {
    CustomPoint result;
    result.point = Vec3D(0.5, 0.5, 0.125 * id.instance_id(id.depth() - 1));
    const Vec3D from = at.point - result.point;
    result.squared = from.x * from.x + from.y * from.y + from.z * from.z;
    result.u = id.path().instance[0];
    return result;
  }
};

template <class LayoutType, unsigned kLevels> struct Levelled : Instanced<WithLayout<LayoutType>, kLevels> {};

}  // namespace

TEST_CASE("closest custom primitives do not depend on trees over instances") {
  check<Levelled<PlanesLayout, 1>>({kSeed, NodeLayout::kPlanes, 1, false}, kSeed, 1500);
  check<Levelled<QuantizedLayout, 2>>({kSeed + 1, NodeLayout::kQuantized, 2, false}, kSeed, 1500);
  check<Instanced<DoubleRays<>, 2>>({kSeed + 2, NodeLayout::kPlanes, 2, false}, kSeed, 1500);
}

TEST_CASE("closest custom primitives of moving instances") {
  check<Moving<Levelled<PlanesLayout, 2>>>({kSeed + 3, NodeLayout::kPlanes, 2, true}, kSeed, 1500);
}

TEST_CASE("functors of points read the instances, and a table has a row per kind of query") {
  CustomWorld world;
  world.add({Box{{0, 0, 0}, {1, 1, 1}}}, 0);
  InstanceScene scene;
  scene.files.push_back(std::move(world.scene({}).bvh.buffer));
  scene.groups = {{Instance{.object = 0, .id = 2}, Instance{.object = 0, .id = 6}}};
  scene.build();
  const SceneView view = scene.view();
  using Table = PrimitiveTable<PrimitiveList<Marks>, NoPrimitives>;
  const auto at = [&](float z, unsigned row) {
    const TableRow<Table> primitives{Table{PrimitiveList<Marks>{Marks{}}, NoPrimitives{}}, row};
    return closest_point<Instanced<>>(view, {{0.5f, 0.5f, z}}, primitives);
  };
  REQUIRE((at(0, 0).distance() == 0.25f && at(0, 0).path.instance[0] == 0 && at(0, 0).u == 0));
  REQUIRE((at(1, 0).distance() == 0.25f && at(1, 0).path.instance[0] == 1 && at(1, 0).u == 1));
  REQUIRE((at(0.5f, 0).distance() == 0.25f && at(0.5f, 0).path.instance[0] == 0));  // Of two the lowest path.
  REQUIRE((!at(0, 1).found() && !at(0, 1).failed() && !at(0, 7).found()));
}

TEST_CASE("policies with levels find the same in a scene without instances") {
  const NearWorld world(kSeed + 4);
  const Scene scene = world.world.scene({});
  Random random(kSeed + 4);
  using P = Instanced<Policies, 2>;
  for (unsigned i = 0; i < trials(1500); ++i) {
    const PointQuery query{vec3(random.in_cube(2)), 1.0f, 0xffffffffu, 0.25f};
    const auto all = try_all(world, query);
    P::Stack::Memory memory;
    REQUIRE(same_point<float>(closest_point<P>(scene.traced, query, memory, world.shapes()),
                              all.empty() ? ClosestPoint{} : all[0]));
  }
}

TEST_CASE("the distance from turned and scaled shapes is that of the placed shapes") {
  const CurveVertex vertices[] = {{{0.5f, -1, 0}, 0.25f}, {{-0.5f, 1, 0.5f}, 0.75f}};
  constexpr std::uint32_t kFirst = 0;
  const PrimitiveList<RoundCurveSet> list{RoundCurveSet{vertices, &kFirst}};
  CustomWorld world;
  world.add({RoundCurveSet::bounds(vertices[0], vertices[1])}, 0);
  Random random(kSeed + 5);
  double worst = 0;
  for (const double scale : {1e-10, 0.5, 3.0, 1e10}) {
    InstanceScene scene;
    scene.files.push_back(std::move(world.scene({}).bvh.buffer));
    const double mirror = scale == 3.0 ? -scale : scale;
    scene.groups = {{Instance{.object = 0,
                              .to_scene = affine({0, 0.6, 0.8}, 1.25, {mirror, scale, scale}, {scale, 2 * scale, 0})}}};
    scene.build();
    const SceneView view = scene.view();
    const Affine& to_scene = scene.groups[0][0].to_scene;
    const auto placed = [&](const CurveVertex& v) {
      std::array<double, 3> at{};
      for (std::size_t r = 0; r < 3; ++r)
        at[r] = double{to_scene.row[r][0]} * double{v.position[0]} +
                double{to_scene.row[r][1]} * double{v.position[1]} +
                double{to_scene.row[r][2]} * double{v.position[2]} + double{to_scene.row[r][3]};
      return at;
    };
    const oracle::LineAndBalls in{{}, {}, placed(vertices[0]), placed(vertices[1]), scale * 0.25, scale * 0.75};
    for (unsigned i = 0; i < trials(100); ++i) {
      const Position at = random.in_cube(scale * random.log_uniform(0.1, 10));
      Instanced<>::Stack::Memory memory;
      const auto near = closest_point<Instanced<>>(view, {vec3(at)}, memory, list);
      const double exact = std::abs(static_cast<double>(oracle::distance_to_surface(in, {at[0], at[1], at[2]}).value));
      INFO("scale " << scale << ", seed " << kSeed + 5 << ", point " << i << ", exact " << exact);
      const double off = std::abs(std::sqrt(near.distance_squared) - exact) / (exact + 3 * scale);
      REQUIRE(off < 0x1p-22);  // The instance's matrix is a turn within the rounding of floats.
      worst = std::max(worst, off);
    }
  }
  std::printf("turned curves, seed %llu: distances within %.3g\n", static_cast<unsigned long long>(kSeed) + 5, worst);
}
