// Spheres and curves in a file: hits are those of a loop over all shapes, and of the exact oracle. Moving triangles:
// those of the still mesh of that time.

#include <hiprt_build/format/view.h>
#include <hiprt_build/shapes.h>
#include <hiprt_device/primitives/scene_shapes.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/motions.h>
#include <tests/oracle/ray_round_cone.h>
#include <tests/traversal/customs/shape_scenes.h>

#include <algorithm>
#include <cmath>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261123;

template <class P> auto closest(const SceneView& view, const Ray& ray) {
  typename P::Stack::Memory memory;
  const SceneShapes shapes(view);
  return ClosestHit<P, NoFilter, SceneShapes>(view, ray, typename P::Stack::Storage(memory), {}, shapes).next_hit();
}
template <class P> auto any(const SceneView& view, const Ray& ray) {
  typename P::Stack::Memory memory;
  const SceneShapes shapes(view);
  return AnyHit<P, NoFilter, SceneShapes>(view, ray, typename P::Stack::Storage(memory), {}, shapes).next_hit();
}

/// A query without custom primitives gives the hits of the mesh.
template <class Layout> void check_flat(build::Builder builder) {
  using P = WithLayout<Layout>;
  const ShapeObject object(kSeed, 30);
  const build::Buffer file = object.build(Layout::kId, builder);
  const SceneView view = make_scene_view(*open_buffer(file.bytes()));
  const std::vector<oracle::Mesh> meshes{object.mesh};
  const auto mesh = build::build(oracle::views(meshes), {.nodes = Layout::kId});
  const SceneView mesh_view = make_scene_view(*open_buffer(mesh->buffer.bytes()));
  Random random(kSeed + 1);
  unsigned hits = 0, curves = 0, spheres = 0;
  for (unsigned i = 0; i < 20000; ++i) {
    Ray ray = random_ray(random, 2);
    ray.mask = 0xffffffffu;
    Hit expected = closest_hit<P>(mesh_view, ray);
    object.search(ray, expected);
    const Hit hit = closest<P>(view, ray);
    INFO("seed " << kSeed + 1 << ", ray " << i);
    REQUIRE(any<P>(view, ray).found() == expected.found());
    REQUIRE(hit.found() == expected.found());
    if (!hit.found()) continue;
    ++hits;
    curves += hit.geometry == 1 ? 1 : 0;
    spheres += hit.geometry == 2 ? 1 : 0;
    REQUIRE((hit.t == expected.t && hit.u == expected.u && hit.v == expected.v));
    REQUIRE((hit.geometry == expected.geometry && hit.primitive == expected.primitive));
    REQUIRE((hit.normal == expected.normal && hit.error == expected.error));
  }
  CHECK(hits > 4000);
  CHECK(curves > 500);
  CHECK(spheres > 500);
}

template <class P> void check_instances(unsigned levels) {
  const ShapeScene scene(levels, kSeed);
  const SceneView view = scene.view();
  Random random(kSeed + levels);
  unsigned hits = 0, of_shapes = 0;
  for (unsigned i = 0; i < 3000; ++i) {
    Ray ray = random_ray(random, 6);
    ray.mask = 0xffffffffu;
    const Hit expected = scene.closest_of_all(view, ray);
    const auto hit = closest<P>(view, ray);
    INFO("seed " << kSeed + levels << ", ray " << i);
    REQUIRE(hit.found() == expected.found());
    if (!hit.found()) continue;
    ++hits;
    of_shapes += hit.geometry != 0 ? 1 : 0;
    REQUIRE(hit.t == expected.t);
    REQUIRE((hit.geometry == expected.geometry && hit.primitive == expected.primitive));
  }
  CHECK(hits > 250);
  CHECK(of_shapes > 100);
}

/// The plane z = 0.5.
struct Plane {
  template <class Report> bool intersect(const Ray& ray, float, float, std::uint32_t, Report&& report) const {
    return report(CustomHit{(0.5f - ray.origin.z) / ray.direction.z, 0, 0, Vec3(0, 0, 1), 0});
  }
};

}  // namespace

TEST_CASE("shapes in a file have the hits of shapes in the program, in every layout") {
  check_flat<PlanesLayout>(build::Builder::kSah);
  check_flat<QuantizedLayout>(build::Builder::kLbvh);
}

TEST_CASE("shapes in instances, in motion and on two levels") {
  check_instances<Moving<Instanced<Policies, 1>>>(1);
  check_instances<Moving<Instanced<Policies, 2>>>(2);
}

TEST_CASE("exact arithmetic confirms the hits of a file's shapes") {
  const ShapeObject object(kSeed + 3, 20);
  const build::Buffer file = object.build(NodeLayout::kPlanes, build::Builder::kSah);
  const SceneView view = make_scene_view(*open_buffer(file.bytes()));
  Random random(kSeed + 4);
  unsigned hits = 0;
  for (unsigned i = 0; i < 400; ++i) {
    const auto from = random.in_cube(2), to = random.in_cube(1);
    Ray ray;
    ray.origin = Vec3(from[0], from[1], from[2]);
    ray.direction = Vec3(to[0], to[1], to[2]) - ray.origin;
    const auto hit = closest<Policies>(view, ray);
    const auto line = [&](const ShapePoint& a, const ShapePoint& b) {
      oracle::LineAndBalls balls{};
      for (int k = 0; k < 3; ++k) {
        const auto axis = static_cast<std::size_t>(k);
        balls.origin[axis] = ray.origin[k];
        balls.direction[axis] = ray.direction[k];
        balls.p0[axis] = a.position[k];
        balls.p1[axis] = b.position[k];
      }
      balls.r0 = a.radius;
      balls.r1 = b.radius;
      return balls;
    };
    if (!hit.found() || hit.geometry == 0) continue;
    ++hits;
    const ShapePoint* a =
        hit.geometry == 2 ? &object.balls[hit.primitive] : &object.axes[object.segments[hit.primitive]];
    const auto crossings = oracle::cross_exactly(line(*a, hit.geometry == 2 ? *a : a[1]));
    INFO("seed " << kSeed + 4 << ", ray " << i);
    REQUIRE(crossings.has_value());
    const double enter = crossings->enter.get_d(), exit = crossings->exit.get_d(), t = hit.t;
    REQUIRE(std::min(std::fabs(enter - t), std::fabs(exit - t)) <= 1e-6);
  }
  CHECK(hits > 100);
}

TEST_CASE("queries refuse custom primitives whose shapes are not in the file") {
  const std::vector<Box> boxes{{{-1, -1, -1}, {1, 1, 1}}};
  const build::CustomGeometry customs[] = {{.boxes = boxes}};
  const auto bvh = build::build(build::SceneInput{{}, customs});
  REQUIRE(bvh.has_value());
  const SceneView view = make_scene_view(*open_buffer(bvh->buffer.bytes()));
  const Ray ray{.origin = {0, 0, 5}, .direction = {0, 0, -1}};
  CHECK(closest<Policies>(view, ray).failed());
  CHECK(any<Policies>(view, ray).failed());
}

TEST_CASE("a program's own primitives beside a file's shapes") {
  const ShapePoint balls[] = {{{5, 0, 0}, 1}};
  const build::Shapes spheres{ShapeKind::kSpheres, balls, {}};
  const auto ball_boxes = build::shape_boxes(spheres);
  const std::vector<Box> own{{{-1, -1, 0.5f}, {1, 1, 0.5f}}};
  const build::CustomGeometry customs[] = {{.boxes = *ball_boxes, .type = 0, .shapes = spheres},
                                           {.boxes = own, .type = 1}};
  const auto bvh = build::build(build::SceneInput{{}, customs});
  REQUIRE(bvh.has_value());
  const SceneView view = make_scene_view(*open_buffer(bvh->buffer.bytes()));
  using Both = PrimitiveList<SceneShapes, Plane>;
  const auto t = [&](float x) {
    const Ray ray{.origin = {x, 0, 5}, .direction = {0, 0, -1}};
    PrivateStack<>::Memory memory;
    return ClosestHit<Policies, NoFilter, Both>(view, ray, memory, {}, Both(SceneShapes(view), Plane{})).next_hit().t;
  };
  CHECK(t(5) == 4.0f);
  CHECK(t(0) == 4.5f);
}

namespace {

/// Closest points of moving triangles are those of the still mesh of that time.
void check_points(const SceneView& view, const oracle::Mesh& still, float time, Random& random) {
  for (unsigned k = 0; k < 20; ++k) {
    const oracle::Position p = random.in_cube(2);
    const Vec3D point(p[0], p[1], p[2]);
    const std::uint32_t i = random.below(static_cast<std::uint32_t>(still.triangles.size()));
    Vec3D corner[3];
    for (unsigned c = 0; c < 3; ++c) {
      const auto& at = still.positions[still.triangles[i][c]];
      corner[c] = Vec3D(at[0], at[1], at[2]);
    }
    const TrianglePoint expected = closest_on_triangle(corner, point);
    const CustomPoint near = SceneShapes(view).closest(PointInObject{point, 100, time}, PrimitiveId{0, i});
    REQUIRE(near.squared == expected.squared);
    REQUIRE((near.point == expected.point && near.u == expected.u && near.v == expected.v));
  }
}

}  // namespace

TEST_CASE("moving triangles of a file have the hits of the static mesh at that time, bit by bit") {
  INFO("seed " << kSeed);
  const oracle::Mesh first = oracle::icosphere(2);
  for (const std::uint32_t keys : {2u, 3u, 6u, 50u}) {
    std::vector<oracle::Mesh> meshes{first};
    for (std::uint32_t k = 1; k < keys; ++k) meshes.push_back(oracle::shaken(first, 0.3, kSeed + k));
    std::vector<ShapePoint> points;
    std::vector<std::uint32_t> corners;
    Random random(kSeed + keys);
    std::vector<float> times;
    for (const oracle::Mesh& mesh : meshes) {
      times.push_back(times.empty() ? -0.5f : times.back() + random.uniform_float(0.01f, 1));
      for (const auto& p : mesh.positions) points.push_back({{p[0], p[1], p[2]}, times.back()});
    }
    for (const auto& t : first.triangles) corners.insert(corners.end(), t.begin(), t.end());
    const build::Shapes shapes{ShapeKind::kMovingTriangles, points, corners, keys};
    const auto boxes = build::shape_boxes(shapes);
    REQUIRE(boxes.has_value());
    const build::CustomGeometry custom{.boxes = *boxes, .shapes = shapes};
    const auto moving = build::build(build::SceneInput{{}, {&custom, 1}});
    REQUIRE(moving.has_value());
    REQUIRE(validate(moving->buffer.bytes()).has_value());
    const SceneView view = make_scene_view(*open_buffer(moving->buffer.bytes()));
    unsigned hits = 0;
    for (unsigned i = 0; i < 40; ++i) {
      // At keys, before and behind all of them, and between them.
      const float time = i < keys && i < 10 ? times[i]
                         : i == 10          ? -9.0f
                         : i == 11          ? 99.0f
                                            : random.uniform_float(times.front(), times.back());
      std::size_t key = 0;
      while (key + 2 < keys && times[key + 1] <= time) ++key;
      const float s = time <= times[key]       ? 0.0f
                      : time >= times[key + 1] ? 1.0f
                                               : (time - times[key]) / (times[key + 1] - times[key]);
      oracle::Mesh still = first;
      for (std::size_t v = 0; v < still.positions.size(); ++v)
        for (std::size_t axis = 0; axis < 3; ++axis)
          still.positions[v][axis] =
              std::fma(s, meshes[key + 1].positions[v][axis], (1.0f - s) * meshes[key].positions[v][axis]);
      check_points(view, still, time, random);
      const std::vector<build::TriangleMesh> views{still.view()};
      const auto built = build::build(views);
      const SceneView still_view = make_scene_view(*open_buffer(built->buffer.bytes()));
      for (unsigned k = 0; k < 60; ++k) {
        Ray ray = random_ray(random, 2);
        ray.mask = 0xffffffffu;
        ray.time = time;
        INFO(keys << " keys, time " << time << ", ray " << k);
        const Hit expected = closest_hit<Policies>(still_view, ray), hit = closest<Policies>(view, ray);
        REQUIRE(hit.found() == expected.found());
        REQUIRE(any<Policies>(view, ray).found() == expected.found());
        if (!hit.found()) continue;
        ++hits;
        REQUIRE((hit.t == expected.t && hit.u == expected.u && hit.v == expected.v));
        REQUIRE((hit.primitive == expected.primitive && hit.normal == expected.normal));
      }
    }
    CHECK(hits > 300);
  }
}
