// Moving scenes: hits do not depend on the top-level trees, at any time.

#include <hiprt_device/math/vec_functions.h>
#include <tests/traversal/instances/moving_scenes.h>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261122;

template <class LayoutType, unsigned kLevels> struct Tracer : Moving<Instanced<WithLayout<LayoutType>, kLevels>> {};
template <class LayoutType, unsigned kLevels> struct PostponedTracer : Tracer<LayoutType, kLevels> {
  using Schedule = Postponed;
};

struct Counted : Policies {
  using Counter = WorkCounter;
};
using CountingTracer = Moving<Instanced<Counted>>;

/// Groups of instances of earlier objects; most instances move.
struct MovingScene : InstanceScene {
  std::vector<std::unique_ptr<build::Motion>> motions;

  MovingScene(std::uint64_t seed, NodeLayout layout, unsigned levels, std::uint32_t instances) {
    Random random(seed);
    add_file({oracle::icosphere(2)}, layout);
    add_file({oracle::soup(40, 0.5, seed), oracle::torus(12, 8, 0.4)}, layout);
    for (unsigned level = 0; level < levels; ++level) {
      std::vector<Instance> group(instances);
      for (std::uint32_t i = 0; i < instances; ++i) {
        const auto objects = static_cast<std::uint32_t>(files.size() + level);
        group[i] = {.object = i == 0 ? objects - 1 : random.below(objects),
                    .to_scene = random_affine(random, 3.0),
                    .mask = random.below(6) == 0 ? 2u : 0xffffffffu};
        if (random.below(4) == 0) continue;
        const auto kind = static_cast<MotionKind>(1 + random.below(3));
        motions.push_back(std::make_unique<build::Motion>(random_motion(random, kind, 1 + random.below(4), 3.0)));
        group[i].motion = motions.back().get();
      }
      groups.push_back(group);
    }
  }
};

}  // namespace

TEMPLATE_TEST_CASE("hits of moving instances do not depend on trees over instances, in every layout", "", FloatLayout,
                   PlanesLayout, HalfLayout, QuantizedLayout) {
  for (unsigned levels = 1; levels <= 3; ++levels) {
    MovingScene scene(kSeed + levels, TestType::kId, levels, 9);
    scene.build();
    CHECK((scene.view().features & feature_bit(Feature::kMotion)) != 0);
    check_rays<Tracer<TestType, 3>>(scene, kSeed, 300);
    check_rays<PostponedTracer<TestType, 3>>(scene, kSeed + 1, 100);
  }
  MovingScene scene(kSeed, TestType::kId, 1, 30);
  scene.build();
  check_rays<Tracer<TestType, 1>>(scene, kSeed, 500);
  check_rays<PostponedTracer<TestType, 1>>(scene, kSeed, 200);
}

TEST_CASE("boxes of moving instances hide no hit, for every kind of bounds") {
  for (const auto bounds : {build::InstanceBounds::kRoot, build::InstanceBounds::kChildren,
                            build::InstanceBounds::kGrandchildren, build::InstanceBounds::kPrimitives}) {
    MovingScene scene(kSeed, NodeLayout::kPlanes, 2, 12);
    scene.build({.bounds = bounds});
    check_rays<Tracer<PlanesLayout, 2>>(scene, kSeed, 300);
  }
}

TEST_CASE("before the first key and after the last an instance does not move; a NaN time gives a miss") {
  build::Motion motion{.keys = {turned_key(2, {0, 0, 1}, 0, {0, 0, 0}), turned_key(3, {0, 0, 1}, 1, {8, 0, 0})}};
  InstanceScene scene;
  scene.add_file({oracle::icosphere(1)}, NodeLayout::kPlanes);
  scene.groups = {{{.object = 0, .motion = &motion}}};
  scene.build();
  const auto is_at = [&](float x, float time) {
    return closest_hit<Tracer<PlanesLayout, 1>>(scene.view(),
                                                {.origin = {x, 0.1f, -5}, .direction = {0, 0, 1}, .time = time})
        .found();
  };
  for (const float time : {-1e30f, -1.0f, 0.0f, 2.0f}) CHECK((is_at(0, time) && !is_at(8, time)));
  for (const float time : {3.0f, 4.0f, 1e30f, std::numeric_limits<float>::infinity()})
    CHECK((is_at(8, time) && !is_at(0, time)));
  CHECK((is_at(4, 2.5f) && !is_at(0, 2.5f) && !is_at(8, 2.5f)));
  CHECK_FALSE(is_at(0, std::numeric_limits<float>::quiet_NaN()));
}

TEST_CASE("a ray enters only instances that are near it at its time") {
  // Ten spheres that cross the same region, one after the other.
  std::vector<std::unique_ptr<build::Motion>> motions;
  InstanceScene scene;
  scene.add_file({oracle::icosphere(1)}, NodeLayout::kPlanes);
  scene.groups.emplace_back();
  for (unsigned i = 0; i < 10; ++i) {
    const double x = 4.0 * i;
    motions.push_back(std::make_unique<build::Motion>(
        build::Motion{.keys = {turned_key(5, {0, 0, 1}, 0, {x, 0, 0}), turned_key(9, {0, 0, 1}, 1, {x - 40, 0, 0})}}));
    scene.groups[0].push_back({.object = 0, .motion = motions.back().get()});
  }
  scene.build();
  const SceneView view = scene.view();
  CHECK((view.features & feature_bit(Feature::kMovingBoxes)) != 0);
  CHECK(view.shutter_begin == 5);
  CHECK(view.shutter_rate == 0.25f);
  for (unsigned i = 0; i < 10; ++i) {
    // Sphere i is at x = 0 then.
    const float time = 5.0f + 0.4f * static_cast<float>(i);
    const Ray ray{.origin = {0, 0.1f, -5}, .direction = {0, 0, 1}, .time = time};
    CountingTracer::Stack::Memory memory;
    ClosestHit<CountingTracer> query(view, ray, memory);
    const auto hit = query.next_hit();
    REQUIRE(hit.found());
    CHECK(hit.path.instance[0] == i);
    CHECK(query.counter().instance_tests == 1);
  }
}

TEST_CASE("moving instances need tracers that cover motion") {
  MovingScene moving(kSeed, NodeLayout::kPlanes, 1, 5);
  moving.build();
  CHECK_FALSE(covers<Instanced<Policies>>(moving.view()));
  CHECK(closest_hit<Instanced<Policies>>(moving.view(), Ray{}).failed());
  // On static scenes these tracers have the hits of the others.
  InstanceScene still;
  still.add_file({oracle::icosphere(2)}, NodeLayout::kPlanes);
  Random random(kSeed);
  still.groups.push_back(std::vector<Instance>(20));
  for (Instance& instance : still.groups[0]) instance.to_scene = random_affine(random, 3.0);
  const build::Motion one_key{.keys = {{.time = 5}}};
  still.groups[0][3].motion = &one_key;
  still.build();
  CHECK((still.view().features & feature_bit(Feature::kMotion)) == 0);
  for (unsigned i = 0; i < 300; ++i) {
    const Ray ray = random_ray(random, 6.0);
    const auto hit = closest_hit<Tracer<PlanesLayout, 1>>(still.view(), ray),
               other = closest_hit<Instanced<Policies>>(still.view(), ray);
    REQUIRE((hit.t == other.t && hit.path == other.path && hit.error == other.error && hit.normal == other.normal));
  }
}

namespace {

/// A ball in one moving instance.
struct MovingBall : InstanceScene {
  oracle::Mesh mesh = oracle::icosphere(2);
  build::Motion motion;

  explicit MovingBall(build::Motion its_motion) : motion(std::move(its_motion)) {
    add_file({mesh}, NodeLayout::kPlanes);
    groups = {{{.object = 0, .motion = &motion}}};
    build();
  }

  /// At a random time within the keys, at the ball's textbook position.
  Ray random_ray(Random& random) const {
    Ray ray;
    ray.time = random.uniform_float(static_cast<double>(motion.keys.front().time),
                                    static_cast<double>(motion.keys.back().time));
    const Real3 center = moved(motion, ray.time, {0, 0, 0});
    const auto from = random.on_sphere();
    const auto at = random.in_cube(0.5);
    const auto near_center = [&](double x, double y, double z) {
      return Vec3(center[0] + x, center[1] + y, center[2] + z);
    };
    ray.origin = near_center(6 * from[0], 6 * from[1], 6 * from[2]);
    ray.direction = near_center(at[0], at[1], at[2]) - ray.origin;
    return ray;
  }
};

/// The distance of a hit from the plane of its triangle, and how far the box of the hit's error reaches along the
/// normal.
struct PlaneDistance {
  double distance, allowed;
};

/// @param p the corners of the triangle.
PlaneDistance distance_from_plane(const Ray& ray, const Hit& hit, const Real3 (&p)[3]) {
  const float origin[3] = {ray.origin.x, ray.origin.y, ray.origin.z};
  const float direction[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
  Real3 e1, e2, off;
  for (unsigned axis = 0; axis < 3; ++axis) {
    e1[axis] = p[1][axis] - p[0][axis];
    e2[axis] = p[2][axis] - p[0][axis];
    off[axis] = Real{origin[axis]} + Real{hit.t} * Real{direction[axis]} - p[0][axis];
  }
  const Real3 normal{e1[1] * e2[2] - e1[2] * e2[1], e1[2] * e2[0] - e1[0] * e2[2], e1[0] * e2[1] - e1[1] * e2[0]};
  Real along = 0, size = 0, sum = 0;
  for (unsigned axis = 0; axis < 3; ++axis) {
    along += normal[axis] * off[axis];
    size += normal[axis] * normal[axis];
    sum += std::fabs(normal[axis]);
  }
  return {static_cast<double>(std::fabs(along) / std::sqrt(size)),
          static_cast<double>(hit.error) * static_cast<double>(sum / std::sqrt(size))};
}

}  // namespace

TEST_CASE("hits on moving instances are at the textbook position, within their error") {
  Random random(kSeed);
  unsigned hits = 0;
  double most = 0.0;
  for (unsigned i = 0; i < 60; ++i) {
    const auto kind = static_cast<MotionKind>(1 + i % 3);
    const MovingBall scene(random_motion(random, kind, 3, i % 2 == 0 ? 2.0 : 1e4));
    for (unsigned k = 0; k < 200; ++k) {
      const Ray ray = scene.random_ray(random);
      const auto hit = closest_hit<Tracer<PlanesLayout, 1>>(scene.view(), ray);
      if (!hit.found()) continue;
      ++hits;
      Real3 p[3];
      for (unsigned c = 0; c < 3; ++c) {
        const auto& corner = scene.mesh.positions[scene.mesh.triangles[hit.primitive][c]];
        p[c] = moved(scene.motion, ray.time, {corner[0], corner[1], corner[2]});
      }
      const auto [distance, allowed] = distance_from_plane(ray, hit, p);
      INFO("seed " << kSeed << ", motion " << i << ", ray " << k << ", distance " << distance << ", error "
                   << hit.error);
      REQUIRE(distance <= allowed);
      most = std::max(most, distance / allowed);
      // A ray from there does not hit the triangle again.
      Ray next = ray;
      next.direction = hit.normal;
      next.origin = spawn_origin(ray, hit, next.direction);
      const bool outwards = glm::dot(ray.direction, hit.normal) < 0;
      if (outwards) REQUIRE_FALSE(closest_hit<Tracer<PlanesLayout, 1>>(scene.view(), next).found());
    }
  }
  std::printf("hits on moving instances: %u, at most %.3f of their error\n", hits, most);
  CHECK(hits > 5000);
}
