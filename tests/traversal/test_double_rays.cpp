// Rays in double: against exact arithmetic, far from the origin, through instances. Hits do not depend on the tree, and
// nothing leaks.

#include <hiprt_device/math/vec_functions.h>
#include <hiprt_device/query/spawn.h>
#include <hiprt_device/query/t_error.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/double_rays.h>
#include <tests/traversal/instances/instance_scenes.h>
#include <tests/traversal/workers.h>

using namespace hiprt;
using namespace hiprt::checks;

TEST_CASE("doubles are rounded when they become floats, also adjacent ones", "[double]") {
  // g++ 12 forgets it where it makes floats of two doubles at once, and doubles of those (arithmetic.h).
  Random random(kDoubleSeed);
  for (unsigned i = 0; i < trials(1000); ++i) {
    const RayD ray{
        .origin = vec(random.on_sphere()), .tmin = 0.1, .direction = vec(random.on_sphere()), .tmax = 1e9 + 0.1};
    const RayD there_and_back = convert<double>(convert<float>(ray));
    const auto check = [](double before, double after) {
      const volatile float rounded = static_cast<float>(before);
      REQUIRE(after == static_cast<double>(rounded));
    };
    for (int axis = 0; axis < 3; ++axis) {
      check(ray.origin[axis], there_and_back.origin[axis]);
      check(ray.direction[axis], there_and_back.direction[axis]);
    }
    check(ray.tmin, there_and_back.tmin);
    check(ray.tmax, there_and_back.tmax);
    Box box;
    for (unsigned axis = 0; axis < 3; ++axis) {
      box.min[axis] = affine_detail::round_down(ray.origin[static_cast<int>(axis)]);
      box.max[axis] = affine_detail::round_up(ray.origin[static_cast<int>(axis)]);
    }
    for (unsigned axis = 0; axis < 3; ++axis) {
      const double x = ray.origin[static_cast<int>(axis)];
      REQUIRE(double{box.min[axis]} <= x);
      REQUIRE(double{box.max[axis]} >= x);
    }
  }
}

TEST_CASE("hits of double rays do not depend on the tree and are exact up to double's rounding", "[double]") {
  INFO("seed " << kDoubleSeed);
  const std::vector<Mesh> meshes{icosphere(2), oracle::placed(torus(20, 12, 0.4), 0.6, {0.3, 0.1, -0.2})};
  const std::vector<Scene> scenes = all_scenes(meshes);
  double most_t = 0, most_u = 0, most_needed = 0;
  unsigned hits = 0;
  for (const double reach : {0.5, 3.0, 1e3, 1e7, 1e12}) {
    Random random(kDoubleSeed);
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
      const double beside = 64 * kDoubleUnit * reach / 0.02;
      REQUIRE(met.u > -beside);
      REQUIRE(met.v > -beside);
      REQUIRE(met.u + met.v < 1 + beside);
      const double length = glm::length(ray.direction);
      most_t = std::max(most_t, off(expected.t, met.t) * length / (kDoubleUnit * (reach + 2)));
      most_u = std::max(most_u, off(expected.u, met.u) / beside);
      most_needed = std::max(most_needed, off_plane(ray, expected, c) / expected.error);
      CHECK(expected.error < 64 * kDoubleUnit * (reach + 4));
      // Nothing lies in front of it, except edges.
      for (const Mesh& mesh : meshes)
        for (std::size_t k = 0; k < mesh.triangles.size() && i % 8 == 0; ++k) {
          const Met other = meet(ray, corners(mesh, k));
          const bool well_inside = other.u > beside && other.v > beside && other.u + other.v < 1 - beside;
          if (well_inside && other.t >= 0)
            REQUIRE(other.t.get_d() * length > expected.t * length - 1e4 * kDoubleUnit * (reach + 2));
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
  INFO("seed " << kDoubleSeed);
  std::uint64_t rays = 0;
  for (const Closed& unit : closed_meshes())
    for (const auto& [scale, offset] : {std::pair{1.0, 0.0}, {1e-20, 0.0}, {1e15, 0.0}, {10.0, 1e4}}) {
      const Closed closed = checks::placed(unit, scale, {offset, -offset, 0.5 * offset});
      const Scene scene = make_scene({closed.mesh});
      Random random(kDoubleSeed);
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

TEST_CASE("double rays with float values have the hits of float rays", "[double]") {
  const std::vector<Mesh> meshes{icosphere(3)};
  const Scene scene = make_scene(meshes);
  Random random(kDoubleSeed);
  for (unsigned i = 0; i < trials(20000); ++i) {
    const Ray ray = random_ray(random, 3.0);
    const RayD same = convert<double>(ray);
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
    if (hit.primitive == precise.primitive)
      REQUIRE(std::abs(hit.t - precise.t) <=
              double{t_error(scene.traced, ray, hit)} + t_error(scene.traced, same, precise));
  }
}

TEST_CASE("both ends of a double ray belong to it, and hits come in order", "[double]") {
  const std::vector<Mesh> meshes{torus(20, 12, 0.4), oracle::placed(icosphere(2), 0.7, {0, 0, 0})};
  for (const NodeLayout layout : {NodeLayout::kPlanes, NodeLayout::kHalf}) {
    const Scene scene = make_scene(meshes, {.nodes = layout});
    Random random(kDoubleSeed);
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

/// Where the ray enters boxes, and the reports of candidates.
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
  Random random(kDoubleSeed);
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
      CHECK(distance < 2e-4 + 1e-8);  // the error of the mesh
      CHECK(double{hit.error} < 1e-6);
      const double off_by = off_plane(local, hit, corners(mesh, hit.primitive));
      worst = std::max(worst, off_by);
      CHECK(off_by <= double{hit.error});
    }
  }
  std::printf("double rays at 1e7: points off by up to %.3g\n", worst);
  CHECK(worst < 1e-8);
}

TEST_CASE("double rays through many levels equal transforms level by level", "[double]") {
  Random random(kDoubleSeed);
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

TEST_CASE("spawned double rays do not hit the triangle that they left, and start close to it", "[double]") {
  std::uint64_t rays = 0;
  for (const Closed& closed : closed_meshes())
    for (const double reach : {1.0, 1e4, 1e8}) {
      const Scene scene = make_scene({closed.mesh});
      Random random(kDoubleSeed);
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
