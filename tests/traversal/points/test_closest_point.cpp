// Closest points of scenes: every builder, layout and stack against every triangle tried, and against rationals.

#include <hiprt_device/query/double_rays.h>
#include <hiprt_device/traverse/stacks/restart.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/points/point_queries.h>

#include <tests/catch.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20261128;
constexpr double kBound = 0x1p-43;  ///< docs/proofs/closest-points.md, in distances of the farthest corner.
constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Case {
  std::string name;
  std::vector<Mesh> meshes;
  double scale = 1.0;
  Double3 offset{};
};

std::vector<Case> cases() {
  const auto sized = [](const char* name, const Mesh& mesh, double scale, const Double3& offset) {
    return Case{name, {oracle::placed(mesh, scale, offset)}, scale, offset};
  };
  std::vector<Case> result{{"icosphere", {icosphere(3)}},
                           {"needles", {oracle::needles(300, 1e6, 5)}},
                           {"slivers", {oracle::slivers(200, 1e-7, 6)}},
                           {"two soups", {oracle::soup(300, 0.3, 1), oracle::soup(200, 0.1, 2)}},
                           {"T-junctions", {with_t_junctions(icosphere(2), 13)}},
                           {"one triangle", {oracle::soup(1, 1, 3)}}};
  result.push_back(sized("far", icosphere(3), 10, {1e7, -1e7, 5e6}));
  result.push_back(sized("tiny", star(3, 4), 1e-20, {}));
  result.push_back(sized("huge", star(3, 4), 1e20, {}));
  result.push_back(sized("subnormal", oracle::soup(100, 0.5, 8), 1e-42, {}));
  Mesh stadium = oracle::placed(icosphere(3), 1e9);
  append(stadium, oracle::placed(star(3, 9), 1.0, {3e8, 1, 2}));
  result.push_back({"stadium", {stadium}, 1.0, {3e8, 1, 2}});
  Mesh twice = icosphere(2);
  append(twice, icosphere(2));
  for (std::size_t i = 0; i < twice.triangles.size(); i += 2) std::swap(twice.triangles[i][0], twice.triangles[i][2]);
  result.push_back({"duplicates", {twice, icosphere(2)}});
  return result;
}

template <class Real> BasicPointQuery<Real> as(const PointQuery& query) {
  return {BasicVec3<Real>(query.point), static_cast<Real>(query.max_distance), query.mask, query.time};
}

template <class P> void check_one(const Scene& scene, const PointQuery& query, const ClosestPoint& expected) {
  INFO(scene.name << ": expected " << text(expected));
  const ClosestPoint found = closest_point<P>(scene.traced, query);
  INFO("found " << text(found));
  REQUIRE(same_point(found, expected));
}

struct SmallStack : Policies {
  using Stack = PrivateStack<4>;
};
struct Trail : Policies {
  using Stack = RestartStack<2>;
};

}  // namespace

TEST_CASE("the closest point does not depend on builder, layout, leaf size or lanes") {
  for (const Case& it : cases()) {
    const std::vector<Scene> scenes = all_scenes(it.meshes);
    Random random(kSeed);
    for (unsigned i = 0; i < trials(150); ++i) {
      PointQuery query{point_near(it.meshes[0], random, it.scale, it.offset)};
      if (random.below(3) == 0) query.max_distance = static_cast<float>(it.scale * random.log_uniform(1e-3, 10));
      const auto all = try_all(it.meshes, query);
      const ClosestPoint expected = all.empty() ? ClosestPoint{} : all[0];
      INFO(it.name << ", seed " << kSeed << ", point " << i);
      for (const Scene& scene : scenes) {
        with_policies(scene, [&](auto policies) { check_one<decltype(policies)>(scene, query, expected); });
        REQUIRE(same_point(closest_point(scene.traced, query), expected));
      }
    }
  }
}

TEST_CASE("the closest distance is within the bound of the exact one") {
  double worst = 0.0;
  for (const Case& it : cases()) {
    const Scene scene = make_scene(it.meshes);
    Random random(kSeed + 1);
    for (unsigned i = 0; i < trials(30); ++i) {
      const PointQuery query{point_near(it.meshes[0], random, it.scale, it.offset)};
      const ClosestPoint found = closest_point(scene.traced, query);
      const Rational3 point = exact3(position(query.point));
      const ExactNearest exact = nearest(it.meshes, point);
      REQUIRE((found.found() && exact.found));
      const Corners c = corners(it.meshes[exact.geometry], exact.primitive);
      const Corners own = corners(it.meshes[found.geometry], found.primitive);
      const double far = std::max(reach(point, exact_corners(c)), reach(point, exact_corners(own)));
      const double sum = std::sqrt(found.distance_squared) + std::sqrt(exact.squared.get_d());
      const double off =
          sum == 0 ? 0 : std::abs(Rational(Rational(found.distance_squared) - exact.squared).get_d()) / sum;
      INFO(it.name << ", seed " << kSeed + 1 << ", point " << i << ", off " << off << ", far " << far);
      REQUIRE(off <= kBound * far);
      worst = std::max(worst, off / (kBound * far));
    }
  }
  std::printf("closest points, seed %llu: error up to %.4f of the bound\n", static_cast<unsigned long long>(kSeed) + 1,
              worst);
}

TEST_CASE("points so far away that squared distances are beyond floats") {
  const std::vector<Mesh> meshes{oracle::soup(300, 1e-4, 4), oracle::placed(icosphere(2), 1e-12)};
  const std::array scenes{make_scene(meshes), make_scene(meshes, {.nodes = NodeLayout::kHalf})};
  Random random(kSeed + 6);
  for (unsigned i = 0; i < trials(300); ++i) {
    const PointQuery query{vec3(random.in_cube(random.log_uniform(1e15, 3e38)))};
    const ClosestPoint expected = try_all(meshes, query)[0];
    INFO("seed " << kSeed + 6 << ", point " << i);
    for (const Scene& scene : scenes)
      with_policies(scene, [&](auto policies) { check_one<decltype(policies)>(scene, query, expected); });
  }
}

TEST_CASE("points in double, far from the origin") {
  const std::vector<Mesh> meshes{oracle::placed(star(3, 5), 2.0, {1e6, 0, 0})};
  for (const Scene& scene : {make_scene(meshes), make_scene(meshes, {.builder = kEmbreeHigh})}) {
    Random random(kSeed + 2);
    for (unsigned i = 0; i < trials(500); ++i) {
      const Double3 on = target_point(meshes[0], random), away = random.on_sphere();
      const double far = i % 7 == 0 ? 1e30 : random.log_uniform(1e-12, 10);
      const PointQueryD query{{on[0] + far * away[0], on[1] + far * away[1], on[2] + far * away[2]}};
      const auto found = closest_point<DoubleRays<>>(scene.traced, query);
      INFO("seed " << kSeed + 2 << ", point " << i);
      REQUIRE(same_point(found, try_all(meshes, query)[0]));
    }
  }
}

TEST_CASE("a restart trail finds the same points, and a small stack says that it fails") {
  const std::vector<Mesh> meshes{star(4, 5)};
  const Scene scene = make_scene(meshes);
  Random random(kSeed + 3);
  unsigned failed = 0, found = 0;
  for (unsigned i = 0; i < trials(600); ++i) {
    const PointQuery query{point_near(meshes[0], random, 1.0, {})};
    const ClosestPoint expected = closest_point(scene.traced, query);
    REQUIRE(same_point(closest_point<Trail>(scene.traced, query, RestartStack<2>::Storage{}), expected));
    std::uint32_t overflows = 0;
    PrivateStack<4>::Memory memory;
    const ClosestPoint small = closest_point<SmallStack>(scene.traced, query, {memory, &overflows});
    REQUIRE(overflows == (small.failed() ? 1u : 0u));
    ++(small.failed() ? failed : found);
    if (!small.failed()) REQUIRE(same_point(small, expected));
  }
  REQUIRE((failed > 0 && failed + found == trials(600)));
}

TEST_CASE("the ends of the range, masks, and what is no point") {
  Mesh low = grid_plane(4, 2, 0.0f), high = grid_plane(4, 2, 1.0f);
  low.mask = 1, high.mask = 2;
  const Scene scene = make_scene({low, high});
  const auto at = [&](float z, float far, std::uint32_t mask = 3) {
    return closest_point<Policies>(scene.traced, {{0.1f, 0.2f, z}, far, mask});
  };
  REQUIRE((at(2, 1).found() && at(2, 1).geometry == 1 && at(2, 1).distance() == 1.0f));  // The end counts.
  REQUIRE(!at(2, std::nextafter(1.0f, 0.0f)).found());
  REQUIRE((at(0, 0).found() && at(0, 0).distance_squared == 0.0));
  REQUIRE((at(2, kInfinity, 1).geometry == 0 && at(2, kInfinity, 1).distance() == 2.0f));
  REQUIRE((!at(2, kInfinity, 4).found() && !at(2, kInfinity, 4).failed()));
  REQUIRE((!at(2, -1).found() && !at(2, std::nanf("")).found()));
  for (const float odd : {kInfinity, -kInfinity, std::nanf("")}) {
    const ClosestPoint none = at(odd, kInfinity);
    REQUIRE((!none.found() && !none.failed() && none.distance() == kInfinity));
  }
  REQUIRE(at(0.5f, kInfinity).geometry == 0);  // At the same distance the lowest geometry.
  REQUIRE((at(3e38f, kInfinity).found() && at(3e38f, kInfinity).distance() == 3e38f));
}

TEST_CASE("an empty scene has no closest point, and a scene of another layout is refused") {
  const Scene empty = make_scene({Mesh{}}), half = make_scene({icosphere(1)}, {.nodes = NodeLayout::kHalf});
  REQUIRE((!closest_point(empty.traced, Vec3(0)).found() && !closest_point(empty.traced, Vec3(0)).failed()));
  REQUIRE(closest_point<Policies>(half.traced, {}).failed());
  REQUIRE(closest_point(half.traced, Vec3(0)).found());
}

TEST_CASE("a scene with custom primitives is refused") {
  const Mesh mesh = icosphere(1);
  const build::TriangleMesh view = mesh.view();
  const Box box{{0, 0, 0}, {1, 1, 1}};
  const build::CustomGeometry custom{.boxes = {&box, 1}};
  const auto bvh = build::build(build::SceneInput{{&view, 1}, {&custom, 1}});
  REQUIRE(bvh.has_value());
  const SceneView scene = bvh->scene();
  REQUIRE(closest_point(scene, Vec3(0)).failed());
  PrivateStack<>::Memory memory;
  NearestPoint<> points(scene, {}, memory);
  REQUIRE((points.next_point().failed() && points.state() == TraversalState::kRefused));
}

TEST_CASE("triangles come in the order of distance, each once, and a filter leaves some out") {
  const std::vector<Mesh> meshes{star(2, 7), oracle::soup(60, 0.3, 2)};
  for (const Scene& scene : {make_scene(meshes), make_scene(meshes, {.builder = kEmbreeHigh})}) {
    const PointQuery query{{0.3f, 0.2f, -0.1f}, 0.6f};
    auto expected = try_all(meshes, query);
    REQUIRE(expected.size() > 20);
    PrivateStack<>::Memory memory;
    NearestPoint<> points(scene.traced, query, memory);
    for (const ClosestPoint& one : expected) REQUIRE(same_point(points.next_point(), one));
    REQUIRE(!points.next_point().found());
    REQUIRE(points.state() == TraversalState::kFinished);
    const auto odd = [](const PointQuery&, const ClosestPoint& point) {
      return point.primitive % 2 == 0 ? FilterResult::kReject : FilterResult::kAccept;
    };
    NearestPoint<Policies, decltype(odd)> some(scene.traced, query, memory, odd);
    for (const ClosestPoint& one : expected)
      if (one.primitive % 2 != 0) REQUIRE(same_point(some.next_point(), one));
    REQUIRE(!some.next_point().found());
  }
}

TEST_CASE("triangles of random bits end the search, and the others are found") {
  const std::vector<Mesh> meshes{oracle::torture(400, 3)};
  const std::array scenes{make_scene(meshes), make_scene(meshes, {.builder = build::Builder::kLbvh})};
  Random random(kSeed + 5);
  for (unsigned i = 0; i < trials(600); ++i) {
    const PointQuery query{i % 3 == 0 ? Vec3(random.any_float(), random.any_float(), random.any_float())
                                      : vec3(random.in_cube(random.log_uniform(1e-30, 1e30)))};
    const bool is_valid = is_finite(position(query.point));
    const auto all = is_valid ? try_all(meshes, query) : std::vector<ClosestPoint>{};
    INFO("seed " << kSeed + 5 << ", point " << i << ": " << query.point.x << " " << query.point.y << " "
                 << query.point.z);
    for (const Scene& scene : scenes)
      REQUIRE(same_point(closest_point(scene.traced, query), all.empty() ? ClosestPoint{} : all[0]));
  }
}
