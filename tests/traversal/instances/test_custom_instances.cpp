// Custom primitives in instances: the functor gets the ray in object space and the object's index.

#include <hiprt_device/math/vec_functions.h>
#include <tests/traversal/instances/moving_scenes.h>

#include <hiprt_device/primitives/sphere.h>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261125;

/// Spheres of several objects, by the object's number.
struct SpheresOfObjects {
  const std::vector<Sphere>* of_object;

  template <class Report>
  bool intersect(const Ray& ray, float tmin, float tmax, PrimitiveId id, Report&& report) const {
    return SphereSet{of_object[id.object].data()}.intersect(ray, tmin, tmax, id.primitive, report);
  }
};
using Spheres = PrimitiveList<SpheresOfObjects>;

/// Objects of 3, 4, 5 spheres, which groups of instances hold.
struct SphereScene : InstanceScene {
  std::vector<std::vector<Sphere>> spheres;
  build::Motion motion{.keys = {{.time = 0}, {.time = 1, .translation = {1, 2, 0}, .rotation = {1, 0, 0, 1}}}};

  explicit SphereScene(unsigned levels) {
    Random random(kSeed);
    for (unsigned object = 0; object < 3; ++object) {
      std::vector<Box> boxes;
      spheres.emplace_back();
      for (unsigned i = 0; i < 3 + object; ++i) {
        const auto at = random.in_cube(1);
        spheres.back().push_back({{at[0], at[1], at[2]}, random.uniform_float(0.1, 0.5)});
        boxes.push_back(SphereSet::bounds(spheres.back().back()));
      }
      const build::CustomGeometry geometry[1] = {{.boxes = boxes}};
      auto bvh = build::build(build::SceneInput{{}, geometry}, {.builder = build::Builder::kHploc});
      REQUIRE(bvh.has_value());
      files.push_back(std::move(bvh->buffer));
    }
    for (unsigned level = 0; level < levels; ++level) {
      groups.emplace_back(8);
      for (Instance& instance : groups.back()) {
        instance = {.object = random.below(static_cast<std::uint32_t>(3 + level)),
                    .to_scene = random_affine(random, 3)};
        if (random.below(3) == 0) instance.motion = &motion;
      }
      groups.back()[0].object = level == 0 ? 0 : 2 + level;
    }
    build();
  }

  /// The closest hit by a loop over all spheres on all instance paths; the normal in object space.
  Hit closest(const SceneView& view, const Ray& ray) const {
    Hit best;
    for_each_path(view, ray, [&](std::uint32_t object, const Ray& local) {
      for (std::uint32_t k = 0; k < spheres[object].size(); ++k)
        SphereSet{spheres[object].data()}.intersect(local, 0, std::min(best.t, ray.tmax), k, [&](const CustomHit& hit) {
          if (hit.t < best.t) best = {hit.t, hit.u, hit.v, 0, k, hit.normal, hit.error};
          return true;
        });
    });
    return best;
  }
};

template <class P> void check(unsigned levels) {
  const SphereScene scene(levels);
  const SceneView view = scene.view();
  Random random(kSeed + levels);
  unsigned hits = 0;
  for (unsigned i = 0; i < 2000; ++i) {
    Ray ray;
    const auto origin = random.in_cube(6), target = random.in_cube(3);
    ray.origin = Vec3(origin[0], origin[1], origin[2]);
    ray.direction = Vec3(target[0], target[1], target[2]) - ray.origin;
    ray.time = random.uniform_float(-0.5, 1.5);
    const Hit expected = scene.closest(view, ray);
    typename P::Stack::Memory memory;
    const Spheres primitives{{scene.spheres.data()}};
    const auto hit =
        ClosestHit<P, NoFilter, Spheres>(view, ray, typename P::Stack::Storage(memory), {}, primitives).next_hit();
    INFO("seed " << kSeed + levels << ", ray " << i);
    REQUIRE(hit.found() == expected.found());
    if (!hit.found()) continue;
    ++hits;
    REQUIRE((hit.t == expected.t && hit.u == expected.u && hit.primitive == expected.primitive));
    REQUIRE(hit.error >= 0);
    // The normal is the scene's: taken back it is the object's.
    const PathTransform transform(view, hit.path, ray.time);
    const Vec3 back = transform.normal_to_object({hit.normal}).value;
    REQUIRE(glm::dot(back, expected.normal) > 0.9999f * glm::length(back) * glm::length(expected.normal));
  }
  CHECK(hits > 300);
}

}  // namespace

TEST_CASE("custom primitives in instances have the hits of each object's primitives") {
  check<Moving<Instanced<Policies, 1>>>(1);
  check<Moving<Instanced<Policies, 2>>>(2);
}
