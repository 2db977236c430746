// Custom primitives and rays in double: triangles with double vertices, spheres, curves, deforming meshes.

#include <hiprt_build/format/view.h>
#include <hiprt_device/math/vec_functions.h>
#include <hiprt_device/primitives/double_triangle.h>
#include <hiprt_device/primitives/moving_triangle.h>
#include <hiprt_device/primitives/round_curve.h>
#include <hiprt_device/primitives/sphere.h>
#include <tests/traversal/double_rays.h>
#include <tests/traversal/instances/instance_scenes.h>
#include <tests/traversal/workers.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

/// A scene of custom primitives only.
struct CustomScene {
  build::Bvh bvh;
  SceneView view;
  explicit CustomScene(const std::vector<Box>& boxes) {
    const build::CustomGeometry customs[] = {{.boxes = boxes}};
    auto built = build::build(build::SceneInput{.customs = customs});
    REQUIRE(built.has_value());
    bvh = std::move(*built);
    view = make_scene_view(*open_buffer(std::as_const(bvh.buffer).bytes()));
  }
  template <class P, class Set> auto closest(const BasicRay<typename P::Real>& ray, const Set& set) const {
    typename P::Stack::Memory memory;
    return ClosestHit<P, NoFilter, Set>(view, ray, typename P::Stack::Storage(memory), {}, set).next_hit();
  }
};

/// A mesh with detail of a thousandth around a point, vertices in double.
struct FarMesh {
  std::vector<double> positions;
  std::vector<std::uint32_t> triangles;
  FarMesh(const Mesh& mesh, double scale, const Double3& center) {
    for (const Position& p : mesh.positions)
      for (std::size_t k = 0; k < 3; ++k) positions.push_back(scale * double{p[k]} + center[k]);
    for (const Triangle& t : mesh.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
  }
  DoubleTriangleSet set() const { return {{positions.data(), triangles.data()}}; }
  std::vector<Box> boxes() const {
    std::vector<Box> boxes;
    for (std::uint32_t i = 0; i < triangles.size() / 3; ++i) boxes.push_back(set().bounds(i));
    return boxes;
  }
  Vec3D corner(std::size_t triangle, std::size_t i) const {
    const double* p = &positions[3 * std::size_t{triangles[3 * triangle + i]}];
    return {p[0], p[1], p[2]};
  }
};

}  // namespace

TEST_CASE("triangles with double vertices ten million units away: exact, and no leaks", "[double]") {
  const Double3 center{6378137.25, -9999999.123, 1234567.8};
  const FarMesh mesh(icosphere(2), 0.001, center);
  const CustomScene scene(mesh.boxes());
  const PrimitiveList set(mesh.set());
  using P = DoubleRays<>;
  Random random(kDoubleSeed);
  double worst = 0;
  std::uint64_t rays = 0;
  for (const double reach : {0.0, 0.01, 100.0, 1e7})
    for (unsigned i = 0; i < trials(1500); ++i) {
      const auto triangle = random.below(static_cast<std::uint32_t>(mesh.triangles.size() / 3));
      // At a corner, an edge or the inside, from the centre or on that line from before the mesh.
      const double u = i % 3 == 0 ? 0.0 : random.unit(), v = i % 3 == 2 ? (1 - u) * random.unit() : 0.0;
      const Vec3D target = mesh.corner(triangle, 0) + u * (mesh.corner(triangle, 1) - mesh.corner(triangle, 0)) +
                           v * (mesh.corner(triangle, 2) - mesh.corner(triangle, 0));
      RayD ray;
      ray.origin = vec(center) + 1e-4 * vec(random.on_sphere());
      ray.direction = target - ray.origin;
      ray.origin -= (reach / 0.001) * ray.direction;
      INFO("reach " << reach << ", ray " << i << ": " << describe(ray));
      const HitD hit = scene.closest<P>(ray, set);
      REQUIRE(hit.found());
      ++rays;
      if (i % 8 != 0) continue;
      const Rational3 o = exact(ray.origin), d = exact(ray.direction), p0 = exact(mesh.corner(hit.primitive, 0));
      const Rational t(hit.t);
      const Rational3 n =
          cross(minus(exact(mesh.corner(hit.primitive, 1)), p0), minus(exact(mesh.corner(hit.primitive, 2)), p0));
      const Rational3 from = minus({o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]}, p0);
      const Rational off_by = abs(dot(from, n)) / (abs(n[0]) + abs(n[1]) + abs(n[2]));
      CHECK(off_by.get_d() <= double{hit.error});
      CHECK(double{hit.error} < 1e-6);
      worst = std::max(worst, off_by.get_d());
      // A float ray there cannot know better than its own numbers.
      const Hit rough = scene.closest<Policies>(convert<float>(ray), set);
      if (rough.found()) CHECK(double{rough.error} > 0.1);
    }
  std::printf("double vertices at 1e7: %lu rays, points off by up to %.3g\n", rays, worst);
  CHECK(worst < 2e-8);
}

TEST_CASE("float rays hit triangles with double vertices where double rays do", "[double]") {
  const FarMesh mesh(icosphere(3), 1.0, {0.1, 0.2, 0.3});
  const CustomScene scene(mesh.boxes());
  const PrimitiveList set(mesh.set());
  Random random(kDoubleSeed);
  for (unsigned i = 0; i < trials(3000); ++i) {
    const Ray ray = random_ray(random, 3.0);
    RayD same = convert<double>(ray);
    same.tmax = std::numeric_limits<double>::infinity();
    const Hit hit = scene.closest<Policies>(ray, set);
    const HitD precise = scene.closest<DoubleRays<>>(same, set);
    INFO("ray " << i << ": " << describe(same));
    if (!precise.found() || static_cast<float>(precise.t) > ray.tmax) {
      REQUIRE_FALSE(hit.found());
      continue;
    }
    REQUIRE(hit.t == static_cast<float>(precise.t));
    if (hit.primitive == precise.primitive) REQUIRE(hit.u == static_cast<float>(precise.u));
  }
}

TEST_CASE("double rays hit spheres and curves from far away", "[double]") {
  // Spheres and strands about the origin; the exact distance of each hit point from its axis or centre.
  const Sphere spheres[] = {{{0, 0, 0}, 1}, {{2, 0.5f, 0}, 0.25f}, {{-1.5f, 0, 0.25f}, 0.001f}};
  const CurveVertex vertices[] = {{{0, 3, 0}, 0.01f}, {{0.5f, 4, 0.25f}, 0.01f}};
  const std::uint32_t first[] = {0};
  std::vector<Box> boxes;
  for (const Sphere& sphere : spheres) boxes.push_back(SphereSet::bounds(sphere));
  const CustomScene balls(boxes), strands({RoundCurveSet::bounds(vertices[0], vertices[1])});
  const PrimitiveList sphere_set(SphereSet{spheres});
  const PrimitiveList curve_set(RoundCurveSet{vertices, first});
  Random random(kDoubleSeed);
  using P = DoubleRays<>;
  for (const double reach : {10.0, 1e4, 1e7})
    for (unsigned i = 0; i < trials(1000); ++i) {
      const Sphere& sphere = spheres[i % 3];
      RayD ray;
      ray.origin = reach * vec(random.on_sphere());
      const Vec3D centre(sphere.center[0], sphere.center[1], sphere.center[2]);
      ray.direction = centre + 0.7 * double{sphere.radius} * vec(random.on_sphere()) - ray.origin;
      ray.direction *= random.log_uniform(1e-3, 1e3);
      INFO("reach " << reach << ": " << describe(ray));
      const HitD hit = balls.closest<P>(ray, sphere_set);
      REQUIRE(hit.found());
      const Sphere& met = spheres[hit.primitive];
      const Rational3 o = exact(ray.origin), d = exact(ray.direction);
      const Rational t(hit.t);
      const Rational3 from = minus({o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]},
                                   exact(Vec3D(met.center[0], met.center[1], met.center[2])));
      const double distance = std::sqrt(dot(from, from).get_d()) - double{met.radius};
      CHECK(std::abs(distance) <= double{hit.error} + 1e-15);
      CHECK(double{hit.error} < 64 * kDoubleUnit * (reach + 4));

      const double s = random.unit();
      const Vec3D a(0, 3, 0), w(0.5, 1, 0.25);
      ray.direction = a + s * w + 0.005 * vec(random.on_sphere()) - ray.origin;
      const HitD hair = strands.closest<P>(ray, curve_set);
      REQUIRE(hair.found());
      const Vec3D point = (ray.origin - a) + hair.t * ray.direction;
      const double along = std::clamp(glm::dot(point, w) / glm::dot(w, w), 0.0, 1.0);
      CHECK(std::abs(glm::length(point - along * w) - double{vertices[0].radius}) < 1e-7);
    }
}

TEST_CASE("double rays hit moving triangles at their positions at the ray's time", "[double]") {
  // Two keys, and a separate mesh between them, whose vertices are the interpolated ones, rounded.
  const Mesh from = icosphere(2), to = oracle::placed(icosphere(2), 1.5, {0.25, 0, 0});
  std::vector<float> positions;
  for (const Mesh* mesh : {&from, &to})
    for (const Position& p : mesh->positions) positions.insert(positions.end(), p.begin(), p.end());
  std::vector<std::uint32_t> triangles;
  for (const Triangle& t : from.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
  const float times[] = {0, 1};
  const MovingTriangleSet moving{
      {positions.data(), times, triangles.data(), static_cast<std::uint32_t>(from.positions.size()), 2}};
  std::vector<Box> boxes;
  for (std::uint32_t i = 0; i < from.triangles.size(); ++i) boxes.push_back(moving.bounds(i));
  const CustomScene scene(boxes);
  Mesh between = from;
  for (std::size_t i = 0; i < from.positions.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      between.positions[i][k] = motion_detail::between(from.positions[i][k], to.positions[i][k], 0.75f, 0.25f);
  const Scene still = make_scene({between});
  Random random(kDoubleSeed);
  for (unsigned i = 0; i < trials(1000); ++i) {
    RayD ray = ray_at_triangle(between, random, {0, 0, 0}, i % 2 == 0 ? 3.0 : 1e6);
    ray.time = 0.25f;
    const HitD hit = scene.closest<DoubleRays<>>(ray, PrimitiveList(moving));
    const HitD expected = closest(still.traced, ray);
    INFO("ray " << i << ": " << describe(ray));
    REQUIRE(hit.found());
    REQUIRE(hit.t == expected.t);
    REQUIRE(hit.u == expected.u);
    REQUIRE(hit.primitive == expected.primitive);
  }
}
