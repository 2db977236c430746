// Closest points through instances, still and moving: every path and triangle tried, and rationals.

#include <hiprt_device/query/double_rays.h>
#include <tests/traversal/instances/moving_scenes.h>
#include <tests/traversal/points/point_queries.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20261201;

/// A scene of instances whose meshes are known.
struct Placed : InstanceScene {
  std::vector<std::vector<Mesh>> meshes;
  std::vector<std::unique_ptr<build::Motion>> motions;

  void add(const std::vector<Mesh>& of, NodeLayout layout) {
    add_file(of, layout);
    meshes.push_back(of);
  }
};

/// @param moving whether half of the instances move.
Placed random_scene(std::uint64_t seed, NodeLayout layout, unsigned levels, std::uint32_t instances, bool moving) {
  Random random(seed);
  Placed scene;
  Mesh hidden = oracle::soup(40, 0.5, seed);
  hidden.mask = 4;
  scene.add({icosphere(2)}, layout);
  scene.add({hidden, torus(12, 8, 0.4)}, layout);
  for (unsigned level = 0; level < levels; ++level) {
    std::vector<Instance> group(instances);
    for (std::uint32_t i = 0; i < instances; ++i) {
      const auto objects = static_cast<std::uint32_t>(scene.files.size() + level);
      group[i] = {.object = i == 0 ? objects - 1 : random.below(objects),
                  .to_scene = random_affine(random, 3.0),
                  .mask = random.below(6) == 0 ? 2u : 0xffffffffu,
                  .id = 100 * level + i};
      if (!moving || random.coin()) continue;
      const MotionKind kinds[3] = {MotionKind::kSlerp, MotionKind::kNlerp, MotionKind::kMatrix};
      scene.motions.push_back(std::make_unique<build::Motion>(random_motion(random, kinds[random.below(3)], 3, 3.0)));
      group[i].motion = scene.motions.back().get();
    }
    scene.groups.push_back(group);
  }
  scene.build();
  return scene;
}

/// Calls visit(path, records, geometry, primitive, corners) for every triangle that the mask shows.
template <unsigned kLevels> class EveryTriangle {
 public:
  EveryTriangle(const Placed& scene, const SceneView& view, std::uint32_t mask, float time)
      : scene_(scene), view_(view), mask_(mask), time_(time) {}

  template <class Visit> void run(Visit&& visit) {
    path_ = {};
    search(scene_.groups.size() - 1, visit);
  }

 private:
  template <class Visit> void search(std::size_t group, Visit& visit) {
    for (std::uint32_t i = 0; i < scene_.groups[group].size(); ++i) {
      const Instance& instance = scene_.groups[group][i];
      if ((instance.mask & mask_) == 0) continue;
      path_.instance[path_.depth++] = i;
      if (instance.object < scene_.files.size())
        meet(scene_.meshes[instance.object], visit);
      else
        search(instance.object - scene_.files.size(), visit);
      path_.instance[--path_.depth] = 0;
    }
  }
  template <class Visit> void meet(const std::vector<Mesh>& meshes, Visit& visit) {
    std::vector<InstanceRecord> records;
    follow(view_, path_, time_,
           [&](const InstanceRecord& record, const ObjectRecord&, const MotionRecord*) { records.push_back(record); });
    for (std::uint32_t geometry = 0; geometry < meshes.size(); ++geometry) {
      if ((meshes[geometry].mask & mask_) == 0) continue;
      for (std::uint32_t primitive = 0; primitive < meshes[geometry].triangles.size(); ++primitive)
        visit(path_, records, geometry, primitive, corners(meshes[geometry], primitive));
    }
  }

  const Placed& scene_;
  const SceneView& view_;
  std::uint32_t mask_;
  float time_;
  InstancePath<kLevels> path_;
};

/// The closest point by trying every triangle. The library places the vertices.
template <class P>
auto try_all_instances(const Placed& scene, const SceneView& view, const BasicPointQuery<typename P::Real>& query) {
  using Result = ClosestPointOf<typename P::Real, P::kLevels>;
  Result best;
  EveryTriangle<P::kLevels>(scene, view, query.mask, query.time)
      .run([&](const auto& path, const auto& records, std::uint32_t geometry, std::uint32_t primitive,
               const Corners& c) {
        PlacedVertices<P::kLevels> placed;
        for (const InstanceRecord& record : records) placed.enter(record);
        const Vec3D corner[3] = {placed.to_scene(vec3d(c.p0)), placed.to_scene(vec3d(c.p1)),
                                 placed.to_scene(vec3d(c.p2))};
        const TrianglePoint near = closest_on_triangle(corner, Vec3D(query.point));
        const double farthest = query.max_distance;
        Result result;
        result.distance_squared = near.squared;
        result.geometry = geometry;
        result.primitive = primitive;
        result.path = path;
        if (near.squared <= farthest * farthest && (!best.found() || precedes(result, best))) best = result;
      });
  return best;
}

template <class P> void check(const Placed& scene, std::uint64_t seed, unsigned points, bool moving) {
  const SceneView view = scene.view();
  Random random(seed);
  unsigned found = 0;
  for (unsigned i = 0; i < trials(points); ++i) {
    BasicPointQuery<typename P::Real> query;
    const double spread = random.log_uniform(0.5, 20);
    query.point = BasicVec3<typename P::Real>(vec3(random.in_cube(spread)));
    query.mask = random.below(3) == 0 ? 2u : 0xffffffffu;
    if (random.coin()) query.max_distance = random.uniform_float(0.1, 5);
    if (moving) query.time = random.uniform_float(-2, 3);
    const auto expected = try_all_instances<P>(scene, view, query);
    const auto point = closest_point<P>(view, query);
    INFO("seed " << seed << ", point " << i << ": expected " << text(expected) << ", found " << text(point));
    REQUIRE(point.found() == expected.found());
    REQUIRE(point.distance_squared == expected.distance_squared);
    if (!point.found()) continue;
    ++found;
    REQUIRE(
        (point.path == expected.path && point.geometry == expected.geometry && point.primitive == expected.primitive));
  }
  REQUIRE(found > trials(points) / 3);
}

/// A point of the object in the scene that has an instance of it, exactly.
Rational3 exact_to_scene(const InstanceRecord& record, const Rational3& p) {
  const auto row = [&](unsigned r) { return exact3(record.linear[r][0], record.linear[r][1], record.linear[r][2]); };
  const Rational3 a = row(0), b = row(1), c = row(2);
  const Rational3 ab = rational_detail::cross(a, b), bc = rational_detail::cross(b, c),
                  ca = rational_detail::cross(c, a);
  const Rational determinant = rational_detail::dot(a, bc);
  Rational3 result;
  for (unsigned k = 0; k < 3; ++k)
    result[k] = (bc[k] * p[0] + ca[k] * p[1] + ab[k] * p[2]) / determinant + Rational(double{record.translation[k]});
  return result;
}

template <class LayoutType, unsigned kLevels> struct Tracer : Instanced<WithLayout<LayoutType>, kLevels> {};

}  // namespace

TEMPLATE_TEST_CASE("closest points do not depend on trees over instances, in every layout", "", FloatLayout,
                   PlanesLayout, HalfLayout, QuantizedLayout) {
  for (unsigned levels = 1; levels <= 3; ++levels)
    check<Tracer<TestType, 3>>(random_scene(kSeed + levels, TestType::kId, levels, 6, false), kSeed, 150, false);
  check<Tracer<TestType, 1>>(random_scene(kSeed, TestType::kId, 1, 20, false), kSeed, 300, false);
}

TEST_CASE("closest points of moving instances") {
  check<Moving<Tracer<PlanesLayout, 1>>>(random_scene(kSeed + 7, NodeLayout::kPlanes, 1, 12, true), kSeed, 300, true);
  check<Moving<Tracer<PlanesLayout, 2>>>(random_scene(kSeed + 8, NodeLayout::kPlanes, 2, 6, true), kSeed, 200, true);
}

TEST_CASE("closest points in double through instances") {
  check<Instanced<DoubleRays<>, 2>>(random_scene(kSeed + 9, NodeLayout::kPlanes, 2, 6, false), kSeed, 300, false);
}

TEST_CASE("the distance through instances is within its bound of the exact one") {
  const Placed scene = random_scene(kSeed + 10, NodeLayout::kPlanes, 2, 4, false);
  const SceneView view = scene.view();
  Random random(kSeed + 10);
  double worst = 0.0;
  for (unsigned i = 0; i < trials(12); ++i) {
    const PointQuery query{vec3(random.in_cube(5))};
    const auto found = closest_point<Tracer<PlanesLayout, 2>>(view, query);
    REQUIRE(found.found());
    const Rational3 point = exact3(position(query.point));
    Rational best = -1;
    double far = 0.0;
    EveryTriangle<2>(scene, view, query.mask, 0)
        .run([&](const auto&, const auto& records, auto, auto, const Corners& c) {
          RationalCorners corner = exact_corners(c);
          for (std::size_t k = records.size(); k-- > 0;)
            for (Rational3& p : corner) p = exact_to_scene(records[k], p);
          const Rational squared = squared_distance(point, corner);
          if (best < 0 || squared < best) best = squared;
          far = std::max(far, oracle::reach(point, corner));
        });
    // Conditions are below 2^8 a level, here.
    const double off = std::abs(Rational(Rational(found.distance_squared) - best).get_d()) /
                       (std::sqrt(found.distance_squared) + std::sqrt(best.get_d()));
    INFO("seed " << kSeed + 10 << ", point " << i << ", off " << off << ", far " << far);
    REQUIRE(off <= 0x1p-43 * far + 0x1p-48 * static_cast<double>(view.condition) * far);
    worst = std::max(worst, off / far);
  }
  std::printf("closest points through instances, seed %llu: error up to %.3g of the farthest corner\n",
              static_cast<unsigned long long>(kSeed) + 10, worst);
}

TEST_CASE("extreme instances: the distance is that of the placed triangles") {
  Random random(kSeed + 11);
  for (const double scale : {1e-13, 1e13})
    for (const oracle::Double3& stretch : {oracle::Double3{1, 1, 1}, {1, 1, 1e-4}, {-1, 1, 100}}) {
      Placed scene;
      scene.add({star(3, 4)}, NodeLayout::kPlanes);
      scene.groups = {
          {Instance{.object = 0,
                    .to_scene = affine({0, 0.6, 0.8}, 1, {scale * stretch[0], scale * stretch[1], scale * stretch[2]},
                                       {3 * scale, -scale, 0})}}};
      scene.build();
      const SceneView view = scene.view();
      for (unsigned i = 0; i < trials(120); ++i) {
        const PointQuery query{vec3(random.in_cube(scale * random.log_uniform(0.1, 10)))};
        const auto expected = try_all_instances<Instanced<>>(scene, view, query);
        const auto found = closest_point<Instanced<>>(view, query);
        INFO("scale " << scale << ", point " << i << ": " << text(expected) << ", " << text(found));
        REQUIRE((found.distance_squared == expected.distance_squared && found.primitive == expected.primitive));
      }
    }
}

TEST_CASE("policies without levels refuse instances, and the nearest come in order through paths") {
  const Placed scene = random_scene(kSeed + 12, NodeLayout::kPlanes, 2, 6, false);
  const SceneView view = scene.view();
  REQUIRE(closest_point<Policies>(view, {}).failed());
  REQUIRE(closest_point<Instanced<>>(view, {}).failed());
  using P = Instanced<Policies, 2>;
  P::Stack::Memory memory;
  std::vector<PathClosestPoint<2>> found(20);
  const FoundCount count = nearest_points<P>(view, {}, found.data(), 20, memory);
  REQUIRE(count.count == 20);
  NearestPoint<P> points(view, {}, memory);
  for (const auto& one : found) {
    const auto next = points.next_point();
    REQUIRE(
        (next.distance_squared == one.distance_squared && next.path == one.path && next.primitive == one.primitive));
  }
}
