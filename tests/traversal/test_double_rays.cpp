// Rays in double: against exact arithmetic, far from the origin, through instances and motion; hits do not depend on
// the tree, and nothing leaks.

#include <hiprt_device/double_rays.h>
#include <hiprt_device/primitives/double_triangle.h>
#include <hiprt_device/primitives/moving_triangle.h>
#include <hiprt_device/primitives/round_curve.h>
#include <hiprt_device/primitives/sphere.h>
#include <hiprt_device/spawn.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/instance_scenes.h>
#include <tests/traversal/scenes.h>
#include <tests/traversal/workers.h>

#include <catch2/catch.hpp>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20261123;
constexpr double kUnit = 0x1p-53;

template <class LayoutType> struct Far : DoubleRays<Policies<LayoutType>> {};
/// Lets every ray into every box.
struct EveryBox {
  static float margin(const Vec3&, const Box&) { return 0x1p100f; }
  static float margin(const Vec3&, const Box&, float, float) { return 0x1p100f; }
};
template <class LayoutType> struct FarEveryBox : DoubleRays<Policies<LayoutType>> { using Boxes = EveryBox; };

/// ask(policies) for the scene's layout.
template <template <class> class P, class Ask> auto with_layout(const SceneView& scene, Ask&& ask) {
  return dispatch_layout(scene.layout, [&](auto layout) { return ask(P<decltype(layout)>{}); });
}
HitD closest(const SceneView& scene, const RayD& ray) {
  return with_layout<Far>(scene, [&](auto p) { return closest_hit<decltype(p)>(scene, ray); });
}
bool any(const SceneView& scene, const RayD& ray) {
  return with_layout<Far>(scene, [&](auto p) { return any_hit<decltype(p)>(scene, ray); }).found();
}
HitD closest_of_every_box(const SceneView& scene, const RayD& ray) {
  return with_layout<FarEveryBox>(scene, [&](auto p) { return closest_hit<decltype(p)>(scene, ray); });
}

Vec3D vec(const Double3& v) { return {v[0], v[1], v[2]}; }
Vec3D vec(const Position& p) { return {p[0], p[1], p[2]}; }

std::string describe(const RayD& ray) {
  char text[240];
  std::snprintf(text, sizeof text, "origin %a %a %a direction %a %a %a", ray.origin.x, ray.origin.y, ray.origin.z,
                ray.direction.x, ray.direction.y, ray.direction.z);
  return text;
}

using Rational3 = std::array<Rational, 3>;
Rational3 exact(const Vec3D& v) { return {Rational(v.x), Rational(v.y), Rational(v.z)}; }
Rational3 minus(const Rational3& a, const Rational3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Rational3 cross(const Rational3& a, const Rational3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Rational dot(const Rational3& a, const Rational3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Where the ray's line meets a triangle's plane, exactly; inside: the triangle.
struct Met {
  bool inside = false;
  Rational t, u, v;
};
Met meet(const RayD& ray, const Corners& c) {
  const Rational3 o = exact(ray.origin), d = exact(ray.direction);
  const Rational3 p0 = minus(exact(vec(c.p0)), o), p1 = minus(exact(vec(c.p1)), o), p2 = minus(exact(vec(c.p2)), o);
  const Rational w0 = dot(d, cross(p1, p2)), w1 = dot(d, cross(p2, p0)), w2 = dot(d, cross(p0, p1));
  const Rational sum = w0 + w1 + w2;
  if (sum == 0) return {};
  Met met;
  met.u = w1 / sum;
  met.v = w2 / sum;
  met.t = dot(p0, cross(minus(p1, p0), minus(p2, p0))) / sum;
  met.inside = met.u >= 0 && met.v >= 0 && met.u + met.v <= 1;
  return met;
}

double off(double value, const Rational& truth) { return std::abs(Rational(Rational(value) - truth).get_d()); }

/// The point's distance from the triangle's plane, at most per axis.
double off_plane(const RayD& ray, const HitD& hit, const Corners& c) {
  const Rational3 o = exact(ray.origin), d = exact(ray.direction), p0 = exact(vec(c.p0));
  const Rational t(hit.t);
  const Rational3 from = minus({o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]}, p0);
  const Rational3 n = cross(minus(exact(vec(c.p1)), p0), minus(exact(vec(c.p2)), p0));
  const Rational distance = abs(dot(from, n)) / (abs(n[0]) + abs(n[1]) + abs(n[2]));
  return distance.get_d();
}

/// A ray from within @p reach of a place at a point of a triangle's inside, or beyond.
RayD ray_at_triangle(const Mesh& mesh, Random& random, const Double3& place, double reach) {
  const Corners c = corners(mesh, random.below(static_cast<std::uint32_t>(mesh.triangles.size())));
  const double u = random.unit(), v = random.unit() * (1 - u);
  const Vec3D target = vec(c.p0) + u * (vec(c.p1) - vec(c.p0)) + v * (vec(c.p2) - vec(c.p0));
  RayD ray;
  ray.origin = vec(place) + reach * vec(random.on_sphere());
  ray.direction = target - ray.origin;
  ray.direction *= random.log_uniform(1e-3, 1e3);
  return ray;
}

void check_same(const HitD& a, const HitD& b) {
  REQUIRE(a.found() == b.found());
  if (!a.found()) return;
  REQUIRE(a.t == b.t);
  REQUIRE(a.u == b.u);
  REQUIRE(a.v == b.v);
  REQUIRE(a.geometry == b.geometry);
  REQUIRE(a.primitive == b.primitive);
  REQUIRE(a.error == b.error);
}

}  // namespace

TEST_CASE("hits of double rays do not depend on the tree and are exact but for double's rounding", "[double]") {
  INFO("seed " << kSeed);
  const std::vector<Mesh> meshes{icosphere(2), oracle::placed(torus(20, 12, 0.4), 0.6, {0.3, 0.1, -0.2})};
  const std::vector<Scene> scenes = all_scenes(meshes);
  double most_t = 0, most_u = 0, most_needed = 0;
  unsigned hits = 0;
  for (const double reach : {0.5, 3.0, 1e3, 1e7, 1e12}) {
    Random random(kSeed);
    for (unsigned i = 0; i < trials(400); ++i) {
      const RayD ray = ray_at_triangle(meshes[i % 2], random, {0, 0, 0}, reach);
      INFO("reach " << reach << ", ray " << i << ": " << describe(ray));
      const HitD expected = closest_of_every_box(scenes[0].traced, ray);
      REQUIRE(expected.found());
      for (const Scene& scene : scenes) {
        INFO(scene.name);
        check_same(closest(scene.traced, ray), expected);
        REQUIRE(any(scene.traced, ray));
      }
      const Corners c = corners(meshes[expected.geometry], expected.primitive);
      const Met met = meet(ray, c);
      // Beside an edge by its rounding at most.
      const double beside = 64 * kUnit * reach / 0.02;
      REQUIRE(met.u > -beside);
      REQUIRE(met.v > -beside);
      REQUIRE(met.u + met.v < 1 + beside);
      const double length = glm::length(ray.direction);
      most_t = std::max(most_t, off(expected.t, met.t) * length / (kUnit * (reach + 2)));
      most_u = std::max(most_u, off(expected.u, met.u) / beside);
      most_needed = std::max(most_needed, off_plane(ray, expected, c) / expected.error);
      CHECK(expected.error < 64 * kUnit * (reach + 4));
      // Nothing lies before it, but for edges.
      for (const Mesh& mesh : meshes)
        for (std::size_t k = 0; k < mesh.triangles.size() && i % 8 == 0; ++k) {
          const Met other = meet(ray, corners(mesh, k));
          const bool well_inside = other.u > beside && other.v > beside && other.u + other.v < 1 - beside;
          if (well_inside && other.t >= 0)
            REQUIRE(other.t.get_d() * length > expected.t * length - 1e4 * kUnit * (reach + 2));
        }
      ++hits;
    }
  }
  std::printf("double rays: %u hits; t off by up to %.1f units, u by %.2f of its bound, points by %.3f of Hit::error\n",
              hits, most_t, most_u, most_needed);
  CHECK(most_needed < 1);
  CHECK(most_u < 1);
}

TEST_CASE("double rays do not leak, however far they come from", "[double]") {
  INFO("seed " << kSeed);
  std::uint64_t rays = 0;
  for (const Closed& unit : closed_meshes())
    for (const auto& [scale, offset] : {std::pair{1.0, 0.0}, {1e-20, 0.0}, {1e15, 0.0}, {10.0, 1e4}}) {
      const Closed closed = checks::placed(unit, scale, {offset, -offset, 0.5 * offset});
      const Scene scene = make_scene({closed.mesh});
      Random random(kSeed);
      for (const double reach : {0.0, 10.0, 1e6, 1e12})
        for (unsigned i = 0; i < trials(6000); ++i) {
          // From inside, or on that line from before the mesh.
          const Ray inside = aimed_ray(closed, random, 1.0);
          RayD ray;
          ray.origin = Vec3D(inside.origin);
          ray.direction = vec(target_point(closed.mesh, random)) - ray.origin;
          const bool backwards = reach != 0.0;
          if (backwards) {
            ray.origin -= reach * ray.direction;
            ray.direction *= random.log_uniform(1e-9, 1e9);
          }
          INFO(closed.name << " scale " << scale << " reach " << reach << ": " << describe(ray));
          ++rays;
          if (!closest(scene.traced, ray).found() || !any(scene.traced, ray)) FAIL("leaks");
        }
    }
  std::printf("double rays: %lu, none leaks\n", rays);
}

TEST_CASE("double rays of floats hit what float rays hit", "[double]") {
  const std::vector<Mesh> meshes{icosphere(3)};
  const Scene scene = make_scene(meshes);
  Random random(kSeed);
  for (unsigned i = 0; i < trials(20000); ++i) {
    const Ray ray = random_ray(random, 3.0);
    RayD same;
    same.origin = Vec3D(ray.origin);
    same.direction = Vec3D(ray.direction);
    same.tmax = ray.tmax;
    same.mask = ray.mask;
    const Hit hit = closest_hit(scene.traced, ray);
    const HitD precise = closest(scene.traced, same);
    INFO("ray " << i << ": " << describe(same));
    const double length = glm::length(same.direction);
    if (!hit.found() || !precise.found()) {
      // One of the two may end beyond tmax, or pass the silhouette.
      const double t = hit.found() ? double{hit.t} : precise.found() ? precise.t : 0.0;
      const HitD longer = [&] {
        RayD endless = same;
        endless.tmax = std::numeric_limits<double>::infinity();
        return closest(scene.traced, endless);
      }();
      const bool at_end = std::abs(t - same.tmax) * length < 1e-4;
      const bool grazes = longer.found() && std::abs(glm::dot(Vec3D(longer.normal), same.direction)) <
                                                0.1 * glm::length(Vec3D(longer.normal)) * length;
      REQUIRE((hit.found() == precise.found() || at_end || grazes));
      continue;
    }
    if (hit.primitive == precise.primitive) REQUIRE(std::abs(hit.t - precise.t) * length <= 4 * double{hit.error} * 20);
  }
}

TEST_CASE("both ends of a double ray belong to it, and hits come in their order", "[double]") {
  const std::vector<Mesh> meshes{torus(20, 12, 0.4), oracle::placed(icosphere(2), 0.7, {0, 0, 0})};
  for (const NodeLayout layout : {NodeLayout::kPlanes, NodeLayout::kHalf}) {
    const Scene scene = make_scene(meshes, {.nodes = layout});
    Random random(kSeed);
    for (unsigned i = 0; i < trials(1500); ++i) {
      RayD ray = ray_at_triangle(meshes[i % 2], random, {0, 0, 0}, i % 3 == 0 ? 1e7 : 2.0);
      INFO("ray " << i << ": " << describe(ray));
      std::vector<double> in_order, all;
      with_layout<Far>(scene.traced, [&](auto p) {
        using P = decltype(p);
        typename P::Stack::Memory memory;
        ClosestHit<P> closest_query(scene.traced, ray, typename P::Stack::Storage(memory));
        for (HitD hit = closest_query.next_hit(); hit.found(); hit = closest_query.next_hit())
          in_order.push_back(hit.t);
        AllHits<P> all_query(scene.traced, ray, typename P::Stack::Storage(memory));
        for (HitD hit = all_query.next_hit(); hit.found(); hit = all_query.next_hit()) all.push_back(hit.t);
      });
      REQUIRE(std::is_sorted(in_order.begin(), in_order.end()));
      std::sort(all.begin(), all.end());
      REQUIRE(all == in_order);
      REQUIRE_FALSE(in_order.empty());
      const double first = in_order.front(), last = in_order.back();
      RayD part = ray;
      part.tmax = first;
      REQUIRE(closest(scene.traced, part).t == first);
      part.tmax = std::nextafter(first, 0.0);
      REQUIRE_FALSE(closest(scene.traced, part).found());
      part = ray;
      part.tmin = last;
      REQUIRE(closest(scene.traced, part).t == last);
      part.tmin = std::nextafter(last, std::numeric_limits<double>::infinity());
      REQUIRE_FALSE(any(scene.traced, part));
    }
  }
}

namespace {

/// Where the ray enters boxes, and what it is told of candidates.
struct Watcher : NoCounter {
  std::vector<float>* entered;
  std::vector<float>* candidates;
  void on_node(const NodeVisit& visit) const {
    for (unsigned i = 0; i < kBranching; ++i)
      if (visit.met[i]) entered->push_back(visit.enter[i]);
  }
  void on_leaf_at(const std::byte*, NodeRef) const {}
  void on_candidate(unsigned, float t) const { candidates->push_back(t); }
  void on_enter(unsigned) const {}
  void on_exit() const {}
};
struct Watched : DoubleRays<> {
  using Counter = Watcher;
};

}  // namespace

TEST_CASE("observers of double rays see distances along the ray", "[double]") {
  const Mesh mesh = icosphere(2);
  const Scene scene = make_scene({mesh});
  RayD ray;
  ray.origin = {0.1, 0.2, -1e6};
  ray.direction = {0, 0, 1e-3};
  std::vector<float> entered, candidates;
  Watched::Stack::Memory memory;
  ClosestHit<Watched> query(scene.traced, ray, Watched::Stack::Storage(memory), {}, {}, {{}, &entered, &candidates});
  const HitD hit = query.next_hit();
  REQUIRE(hit.found());
  REQUIRE_FALSE(entered.empty());
  for (const float t : entered) CHECK(std::abs(double{t} - 1e9) < 2e3);
  CHECK(std::find(candidates.begin(), candidates.end(), static_cast<float>(hit.t)) != candidates.end());
}

TEST_CASE("double rays that are no rays miss, and those beyond the range end", "[double]") {
  const std::vector<Mesh> meshes{icosphere(1)};
  const Scene scene = make_scene(meshes);
  constexpr double kInfinity = std::numeric_limits<double>::infinity(), kNan = std::numeric_limits<double>::quiet_NaN();
  RayD good;
  good.origin = {0.1, 0.2, -5};
  REQUIRE(closest(scene.traced, good).found());
  for (const double bad : {kInfinity, -kInfinity, kNan})
    for (int k = 0; k < 3; ++k) {
      RayD ray = good;
      ray.origin[k] = bad;
      CHECK_FALSE(closest(scene.traced, ray).found());
      ray = good;
      ray.direction[k] = bad;
      CHECK_FALSE(closest(scene.traced, ray).found());
    }
  RayD ray = good;
  ray.direction = {0, -0.0, 0};
  CHECK_FALSE(closest(scene.traced, ray).found());
  ray = good;
  ray.tmin = 7, ray.tmax = 6.5;
  CHECK_FALSE(closest(scene.traced, ray).found());
  ray = good;
  ray.tmin = kNan;
  CHECK_FALSE(closest(scene.traced, ray).found());
  // Lengths of directions in the range, and origins up to its end.
  for (const double length : {0x1p-200, 1e-30, 1e30, 0x1p199}) {
    ray = good;
    ray.direction *= length;
    CHECK(closest(scene.traced, ray).found());
  }
  for (const double far : {1e6, 1e15, 1e30}) {
    ray = {};
    ray.origin = {0, 0, -far};
    const HitD hit = closest(scene.traced, ray);
    CHECK(hit.found());
    CHECK(std::abs(hit.t - far) <= 1 + far * 4 * kUnit);
  }
  // No guarantee but to come back, without NaN.
  for (const double extreme : {1e-320, 1e-300, 1e200, 1e300, 1.7e308}) {
    ray = good;
    ray.origin.z = -extreme;
    HitD hit = closest(scene.traced, ray);
    CHECK_FALSE(hit.failed());
    ray = good;
    ray.direction *= extreme;
    hit = closest(scene.traced, ray);
    CHECK_FALSE(hit.failed());
  }
}

TEST_CASE("an object of millimetres ten million units away", "[double]") {
  // Its file is in its own coordinates; two instances place it: the first to the nearest whole unit, the second to the
  // rest. Float rays find nothing there.
  InstanceScene scene;
  const Mesh mesh = oracle::placed(icosphere(3), 0.01, {0, 0, 0});
  scene.add_file({mesh}, NodeLayout::kPlanes);
  const Double3 whole{6378137, -9999999, 1234567}, rest{0.25, 0.123, -0.4};
  scene.groups.push_back({{.object = 0, .to_scene = affine({0, 0, 1}, 0.0, {1, 1, 1}, rest)}});
  scene.groups.push_back({{.object = 1, .to_scene = affine({0, 0, 1}, 0.0, {1, 1, 1}, whole)}});
  scene.build();
  const SceneView view = scene.view();
  using P = Instanced<DoubleRays<>, 2>;
  const auto at = [](std::size_t k) {
    return Double3{6378137, -9999999, 1234567}[k] + double{std::array{0.25f, 0.123f, -0.4f}[k]};
  };
  const Double3 centre{at(0), at(1), at(2)};
  Random random(kSeed);
  double worst = 0;
  for (const double reach : {0.05, 100.0, 1e7}) {
    for (unsigned i = 0; i < trials(3000); ++i) {
      RayD ray = ray_at_triangle(mesh, random, {0, 0, 0}, reach);
      ray.origin += vec(centre);
      INFO("reach " << reach << ", ray " << i << ": " << describe(ray));
      RayD local = ray;
      local.origin -= vec(centre);  // Exact: both are multiples of 2^-29.
      const auto hit = closest_hit<P>(view, ray);
      if (!hit.found()) {  // The move may have taken it past the silhouette.
        for (std::size_t k = 0; k < mesh.triangles.size(); ++k) REQUIRE_FALSE(meet(local, corners(mesh, k)).inside);
        continue;
      }
      REQUIRE(hit.path.depth == 2);
      // The point is on the sphere's surface, to far below a millimetre.
      const Vec3D point = (ray.origin - vec(centre)) + hit.t * ray.direction;
      const double distance = std::abs(glm::length(point) - 0.01);
      CHECK(distance < 2e-4 + 1e-8);  // what the mesh is off by
      CHECK(double{hit.error} < 1e-6);
      const double off_by = off_plane(local, hit, corners(mesh, hit.primitive));
      worst = std::max(worst, off_by);
      CHECK(off_by <= double{hit.error});
    }
  }
  std::printf("double rays at 1e7: points off by up to %.3g\n", worst);
  CHECK(worst < 1e-8);
}

TEST_CASE("double rays through many levels are those of the levels one by one", "[double]") {
  Random random(kSeed);
  InstanceScene scene;
  scene.add_file({icosphere(2)}, NodeLayout::kPlanes);
  for (std::uint32_t level = 0; level < 4; ++level) {
    std::vector<Instance> group;
    for (unsigned i = 0; i < 3; ++i) group.push_back({.object = level, .to_scene = random_affine(random, 2.0)});
    scene.groups.push_back(std::move(group));
  }
  scene.build();
  const SceneView view = scene.view();
  using P = Instanced<DoubleRays<>, 4>;
  EveryInstance<P> every(scene, view);
  unsigned hits = 0;
  for (unsigned i = 0; i < trials(2000); ++i) {
    RayD ray;
    ray.origin = std::array{10.0, 1e6, 1e12}[i % 3] * vec(random.on_sphere());
    ray.direction = 2.0 * vec(random.on_sphere()) - ray.origin;
    if (i % 5 == 0) ray.direction *= 1e-9;
    INFO("ray " << i << ": " << describe(ray));
    const auto hit = closest_hit<P>(view, ray);
    const auto expected = every.closest(ray);
    REQUIRE(hit.found() == expected.found());
    REQUIRE(any_hit<P>(view, ray).found() == hit.found());
    if (!hit.found()) continue;
    ++hits;
    REQUIRE(hit.t == expected.t);
    REQUIRE(hit.u == expected.u);
    REQUIRE(hit.primitive == expected.primitive);
    REQUIRE(hit.path == expected.path);
    // A ray that leaves the surface there does not meet it at once.
    RayD next;
    next.direction = -ray.direction;
    next.origin = spawn_origin(ray, hit, next.direction);
    const auto again = closest_hit<P>(view, next);
    CHECK((!again.found() || again.primitive != hit.primitive || !(again.path == hit.path)));
  }
  CHECK(hits > trials(2000) / 10);
}

TEST_CASE("spawned double rays do not meet the triangle that they left, and start close to it", "[double]") {
  std::uint64_t rays = 0;
  for (const Closed& closed : closed_meshes())
    for (const double reach : {1.0, 1e4, 1e8}) {
      const Scene scene = make_scene({closed.mesh});
      Random random(kSeed);
      for (unsigned i = 0; i < trials(3000); ++i) {
        const RayD ray = ray_at_triangle(closed.mesh, random, {0, 0, 0}, reach);
        const HitD hit = closest(scene.traced, ray);
        if (!hit.found()) continue;
        RayD next;
        next.direction = vec(random.on_sphere());
        next.origin = spawn_origin(ray, hit, next.direction);
        INFO(closed.name << " reach " << reach << ": " << describe(ray) << "\nspawned " << describe(next));
        const HitD again = closest(scene.traced, next);
        REQUIRE((!again.found() || again.primitive != hit.primitive));
        REQUIRE(glm::length(next.origin - (ray.origin + hit.t * ray.direction)) <= 2.74 * double{hit.error});
        ++rays;
      }
    }
  std::printf("double rays: %lu spawned\n", rays);
}

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

/// A mesh with detail of a thousandth about a place, vertices in double.
struct FarMesh {
  std::vector<double> positions;
  std::vector<std::uint32_t> triangles;
  FarMesh(const Mesh& mesh, double scale, const Double3& place) {
    for (const Position& p : mesh.positions)
      for (std::size_t k = 0; k < 3; ++k) positions.push_back(scale * double{p[k]} + place[k]);
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
  const Double3 place{6378137.25, -9999999.123, 1234567.8};
  const FarMesh mesh(icosphere(2), 0.001, place);
  const CustomScene scene(mesh.boxes());
  const PrimitiveList set(mesh.set());
  using P = DoubleRays<>;
  Random random(kSeed);
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
      ray.origin = vec(place) + 1e-4 * vec(random.on_sphere());
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
      Ray rounded;
      rounded.origin = Vec3(ray.origin);
      rounded.direction = Vec3(ray.direction);
      const Hit rough = scene.closest<Policies<>>(rounded, set);
      if (rough.found()) CHECK(double{rough.error} > 0.1);
    }
  std::printf("double vertices at 1e7: %lu rays, points off by up to %.3g\n", rays, worst);
  CHECK(worst < 2e-8);
}

TEST_CASE("float rays meet triangles with double vertices where double rays do", "[double]") {
  const FarMesh mesh(icosphere(3), 1.0, {0.1, 0.2, 0.3});
  const CustomScene scene(mesh.boxes());
  const PrimitiveList set(mesh.set());
  Random random(kSeed);
  for (unsigned i = 0; i < trials(3000); ++i) {
    const Ray ray = random_ray(random, 3.0);
    RayD same;
    same.origin = Vec3D(ray.origin);
    same.direction = Vec3D(ray.direction);
    const Hit hit = scene.closest<Policies<>>(ray, set);
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

TEST_CASE("double rays meet spheres and curves from afar", "[double]") {
  // Spheres and strands about the origin; the exact distance of each hit point from its axis or centre.
  const Sphere spheres[] = {{{0, 0, 0}, 1}, {{2, 0.5f, 0}, 0.25f}, {{-1.5f, 0, 0.25f}, 0.001f}};
  const CurveVertex vertices[] = {{{0, 3, 0}, 0.01f}, {{0.5f, 4, 0.25f}, 0.01f}};
  const std::uint32_t first[] = {0};
  std::vector<Box> boxes;
  for (const Sphere& sphere : spheres) boxes.push_back(SphereSet::bounds(sphere));
  const CustomScene balls(boxes), strands({RoundCurveSet::bounds(vertices[0], vertices[1])});
  const PrimitiveList sphere_set(SphereSet{spheres});
  const PrimitiveList curve_set(RoundCurveSet{vertices, first});
  Random random(kSeed);
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
      CHECK(double{hit.error} < 64 * kUnit * (reach + 4));

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

TEST_CASE("double rays meet moving triangles as they are at their time", "[double]") {
  // Two keys; between them a mesh of its own, whose vertices are those in between, rounded.
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
  Random random(kSeed);
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
