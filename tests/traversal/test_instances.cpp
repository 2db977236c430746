// Rays in scenes of instances: what they hit does not depend on the trees over instances, on any number of levels.

#include <tests/traversal/instance_scenes.h>

#include <algorithm>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261122;

template <class LayoutType, unsigned kLevels> struct Tracer : Instanced<Policies<LayoutType>, kLevels> {};
template <class LayoutType, unsigned kLevels> struct PostponedTracer : Instanced<Policies<LayoutType>, kLevels> {
  using Schedule = Postponed;
};

Ray random_ray(Random& random, double spread) {
  Ray ray;
  const auto origin = random.in_cube(spread), target = random.in_cube(0.6 * spread);
  ray.origin = Vec3(origin[0], origin[1], origin[2]);
  ray.direction = Vec3(target[0], target[1], target[2]) - ray.origin;
  if (random.below(4) == 0) ray.tmax = random.uniform_float(0.2, 1.2);
  if (random.below(8) == 0) ray.mask = 2;
  return ray;
}

/// Groups of instances of what is before them.
InstanceScene random_scene(std::uint64_t seed, NodeLayout layout, unsigned levels, std::uint32_t instances) {
  Random random(seed);
  InstanceScene scene;
  scene.add_file({oracle::icosphere(2)}, layout);
  scene.add_file({oracle::soup(40, 0.5, seed), oracle::torus(12, 8, 0.4)}, layout);
  for (unsigned level = 0; level < levels; ++level) {
    std::vector<Instance> group(instances);
    for (std::uint32_t i = 0; i < instances; ++i) {
      // The group before at least once, so that there are as many levels.
      const auto objects = static_cast<std::uint32_t>(scene.files.size() + level);
      group[i] = {.object = i == 0 ? objects - 1 : random.below(objects),
                  .to_scene = random_affine(random, 3.0),
                  .mask = random.below(6) == 0 ? 2u : 0xffffffffu,
                  .id = 100 * level + i};
    }
    scene.groups.push_back(group);
  }
  return scene;
}

template <class P> void check_rays(const InstanceScene& scene, std::uint64_t seed, unsigned rays) {
  const SceneView view = scene.view();
  REQUIRE(covers<P>(view));
  EveryInstance<P> every(scene, view);
  Random random(seed);
  unsigned hits = 0;
  for (unsigned i = 0; i < rays; ++i) {
    const Ray ray = random_ray(random, 6.0);
    const auto expected = every.closest(ray);
    const auto hit = closest_hit<P>(view, ray);
    INFO("ray " << i << " of seed " << seed);
    REQUIRE_FALSE(hit.failed());
    REQUIRE(hit.found() == expected.found());
    REQUIRE(any_hit<P>(view, ray).found() == expected.found());
    if (!hit.found()) continue;
    ++hits;
    REQUIRE(hit.t == expected.t);
    REQUIRE(hit.u == expected.u);
    REQUIRE(hit.path == expected.path);
    REQUIRE(hit.geometry == expected.geometry);
    REQUIRE(hit.primitive == expected.primitive);
  }
  CHECK(hits > rays / 20);
}

}  // namespace

TEMPLATE_TEST_CASE("hits do not depend on trees over instances, in every layout", "", FloatLayout, PlanesLayout,
                   HalfLayout, QuantizedLayout) {
  for (unsigned levels = 1; levels <= 3; ++levels) {
    InstanceScene scene = random_scene(kSeed + levels, TestType::kId, levels, 9);
    scene.build();
    CHECK(scene.view().levels == levels);
    check_rays<Tracer<TestType, 3>>(scene, kSeed, 400);
    check_rays<PostponedTracer<TestType, 3>>(scene, kSeed + 1, 200);
  }
  InstanceScene scene = random_scene(kSeed, TestType::kId, 1, 30);
  scene.build();
  check_rays<Tracer<TestType, 1>>(scene, kSeed, 600);
  check_rays<PostponedTracer<TestType, 1>>(scene, kSeed, 300);
}

TEST_CASE("hits do not depend on how instances' boxes and trees are made") {
  for (const auto bounds : {build::InstanceBounds::kRoot, build::InstanceBounds::kChildren,
                            build::InstanceBounds::kGrandchildren, build::InstanceBounds::kPrimitives})
    for (const auto builder : {build::Builder::kSah, build::Builder::kLbvh, build::Builder::kHploc}) {
      InstanceScene scene = random_scene(kSeed, NodeLayout::kPlanes, 2, 12);
      scene.build({.tree = {.builder = builder}, .bounds = bounds});
      check_rays<Tracer<PlanesLayout, 2>>(scene, kSeed, 300);
    }
}

TEST_CASE("sixteen levels") {
  InstanceScene scene = random_scene(kSeed, NodeLayout::kPlanes, kMostLevels, 2);
  scene.build();
  CHECK(scene.view().levels == kMostLevels);
  CHECK_FALSE(covers<Tracer<PlanesLayout, kMostLevels - 1>>(scene.view()));
  CHECK(closest_hit<Tracer<PlanesLayout, kMostLevels - 1>>(scene.view(), Ray{}).failed());
  CHECK_FALSE(covers<Policies<>>(scene.view()));
}
