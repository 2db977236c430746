// HIPRT's classes Scene... on instances, scenes of scenes and motion, against this library's queries.

#include <tests/compat/instances.h>

using namespace hiprt;
using namespace hiprt::test;

namespace {

template <unsigned kLevels> using Own = Moving<Instanced<Policies, kLevels>>;

template <unsigned kLevels> using Hits = std::vector<PathHit<kLevels>>;

template <unsigned kLevels> void check_same(const hiprtHit& hit, const PathHit<kLevels>& own, const Forest& forest) {
  CHECK(hit.primID == own.primitive);
  CHECK(hit.t == own.t);
  CHECK(hit.uv.x == own.u);
  CHECK(hit.uv.y == own.v);
  for (unsigned level = 0; level < 4; ++level)
    CHECK(hit.instanceIDs[level] == (level < own.path.depth ? own.path.instance[level] : hiprtInvalidValue));
  check_normal(hit, forest.normal_of(hit));
}

template <unsigned kLevels, class Closest, class AnyHit>
void check_ray(const Forest& forest, const Hits<kLevels>& own, Closest&& closest, AnyHit&& any) {
  const hiprtHit hit = closest.getNextHit();
  CHECK(closest.getCurrentState() == hiprtTraversalStateFinished);
  CHECK(is_miss(closest.getNextHit()));
  REQUIRE(hit.hasHit() == !own.empty());
  if (own.empty()) {
    CHECK(is_miss(hit));
  } else {
    const auto nearest =
        std::min_element(own.begin(), own.end(), [](const auto& a, const auto& b) { return a.t < b.t; });
    check_same(hit, *nearest, forest);
  }
  const auto hits = all_hits(any);
  CHECK(any.getCurrentState() == hiprtTraversalStateFinished);
  REQUIRE(hits.size() == own.size());
  for (const hiprtHit& found : hits) {
    const auto same = std::find_if(own.begin(), own.end(), [&](const auto& other) {
      return other.primitive == found.primID && other.t == found.t && other.path.instance[0] == found.instanceIDs[0];
    });
    REQUIRE(same != own.end());
    check_same(found, *same, forest);
  }
}

}  // namespace

TEST_CASE("instances of triangles, still and moving") {
  INFO("seed " << kSeed);
  Random random(kSeed + 20);
  for (const bool moves : {false, true}) {
    Forest forest(random, 3, 12, moves);
    forest.build();
    const SceneView view = forest.view();
    const hiprtScene scene = scene_handle(&view);
    unsigned hits = 0;
    for (unsigned i = 0; i < 300; ++i) {
      CAPTURE(moves, i);
      hiprtRay ray = random_ray(random);
      if (i % 3 == 1) ray.maxT = random.uniform_float(0, 1.5);
      const float time = random.uniform_float(-0.2, 1.2);
      const std::uint32_t mask = i % 4 == 0 ? 1u << random.below(3) : hiprtFullRayMask;
      const auto own = own_hits<Own<1>>(view, own_ray(ray, mask, time));
      hits += own.empty() ? 0 : 1;
      OwnStack<256> stack;
      hiprtEmptyInstanceStack empty;
      hiprtPrivateInstanceStack levels;
      hiprtGlobalInstanceStack global({}, {});
      hiprtGlobalStack named({}, {});
      constexpr auto kHint = hiprtTraversalHintDefault;
      check_ray<1>(forest, own, hiprtSceneTraversalClosest(scene, ray, mask, kHint, nullptr, nullptr, 0, time),
                   hiprtSceneTraversalAnyHit(scene, ray, mask, kHint, nullptr, nullptr, 0, time));
      check_ray<1>(
          forest, own,
          hiprtSceneTraversalClosestCustomStack(scene, ray, stack, empty, mask, kHint, nullptr, nullptr, 0, time),
          hiprtSceneTraversalAnyHitCustomStack(scene, ray, named, empty, mask, kHint, nullptr, nullptr, 0, time));
      check_ray<1>(
          forest, own,
          hiprtSceneTraversalClosestCustomStack(scene, ray, named, global, mask, kHint, nullptr, nullptr, 0, time),
          hiprtSceneTraversalAnyHitCustomStack(scene, ray, stack, levels, mask, kHint, nullptr, nullptr, 0, time));
      CHECK(stack.resets == 2);
    }
    CHECK(hits > 30);
  }
}

TEST_CASE("scenes of scenes") {
  INFO("seed " << kSeed);
  Random random(kSeed + 21);
  for (const bool moves : {false, true}) {
    Forest forest(random, 2, 4, moves);
    forest.add_level(random, 5, moves);
    forest.build();
    const SceneView view = forest.view();
    const hiprtScene scene = scene_handle(&view);
    unsigned hits = 0;
    for (unsigned i = 0; i < 200; ++i) {
      CAPTURE(moves, i);
      const hiprtRay ray = random_ray(random);
      const float time = random.uniform_float(0, 1);
      const auto own = own_hits<Own<2>>(view, own_ray(ray, ~0u, time));
      hits += own.empty() ? 0 : 1;
      OwnStack<256> stack;
      hiprtPrivateInstanceStack levels;
      constexpr auto kHint = hiprtTraversalHintDefault;
      check_ray<2>(forest, own,
                   hiprtSceneTraversalClosest(scene, ray, hiprtFullRayMask, kHint, nullptr, nullptr, 0, time),
                   hiprtSceneTraversalAnyHit(scene, ray, hiprtFullRayMask, kHint, nullptr, nullptr, 0, time));
      check_ray<2>(forest, own,
                   hiprtSceneTraversalClosestCustomStack(scene, ray, stack, levels, hiprtFullRayMask, kHint, nullptr,
                                                         nullptr, 0, time),
                   hiprtSceneTraversalAnyHitCustomStack(scene, ray, stack, levels, hiprtFullRayMask, kHint, nullptr,
                                                        nullptr, 0, time));
    }
    CHECK(hits > 20);
  }
}

TEST_CASE("trap: a scene of scenes has its hits with an empty instance stack, too") {
  INFO("seed " << kSeed);
  Random random(kSeed + 22);
  Forest forest(random, 1, 3, false);
  forest.add_level(random, 3, false);
  forest.build();
  const SceneView view = forest.view();
  hiprtPrivateStack stack;
  hiprtEmptyInstanceStack empty;
  unsigned hits = 0;
  for (unsigned i = 0; i < 200; ++i) {
    CAPTURE(i);
    const hiprtRay ray = random_ray(random);
    const auto own = own_hits<Own<2>>(view, own_ray(ray));
    hits += own.empty() ? 0 : 1;
    check_ray<2>(forest, own, hiprtSceneTraversalClosestCustomStack(scene_handle(&view), ray, stack, empty),
                 hiprtSceneTraversalAnyHitCustomStack(scene_handle(&view), ray, stack, empty));
  }
  CHECK(hits > 20);
}

TEST_CASE("functions in instances get the ray of the object, and the instances") {
  INFO("seed " << kSeed);
  Random random(kSeed + 23);
  const Spheres spheres(Points{{{0, 0, 0}, 1}});
  const Triangles triangles(Corners{{-3, -3, 0}, {3, -3, 0}, {0, 3, 0}});
  Forest forest;
  forest.add_file(spheres.bvh);
  forest.add_file(triangles.bvh);
  for (std::uint32_t i = 0; i < 6; ++i)
    forest.add_instance({.object = i % 2, .to_scene = checks::random_affine(random, 2.0)});
  forest.build();
  forest.set_type(0, 0);
  forest.set_type(1, 1);
  const SceneView view = forest.view();
  const hiprtScene scene = scene_handle(&view);
  Table table(2, 1);
  unsigned filtered[2] = {};
  for (unsigned i = 0; i < 200; ++i) {
    CAPTURE(i);
    const hiprtRay ray = random_ray(random);
    Program program;
    const auto check_call = [&](const Call& call, const hiprtHit& hit) {
      REQUIRE(hit.instanceIDs[0] < 6u);
      CHECK(call.geom_type == hit.instanceIDs[0] % 2);
      for (unsigned level = 1; level < 4; ++level) CHECK(hit.instanceIDs[level] == hiprtInvalidValue);
      const Ray local = ray_to_object(view.instances[hit.instanceIDs[0]], own_ray(ray));
      CHECK(call.ray.origin == compat_detail::to_float3(local.origin));
      CHECK(call.ray.direction == compat_detail::to_float3(local.direction));
    };
    program.intersect = [&](const Call& call, hiprtHit& hit) {
      check_call(call, hit);
      return intersect_sphere(call.ray, spheres.spheres[0], hit);
    };
    program.filter = [&](const Call& call, const hiprtHit& hit) {
      check_call(call, hit);
      ++filtered[call.geom_type];
      return hit.instanceID == 1u;
    };
    float nearest = hiprt::FltMax;
    unsigned count = 0;
    for (std::uint32_t k = 0; k < 6; ++k) {
      const Ray local = ray_to_object(view.instances[k], own_ray(ray));
      hiprtHit hit;
      if (k % 2 == 0) {
        if (!intersect_sphere(
                make_ray(compat_detail::to_float3(local.origin), compat_detail::to_float3(local.direction)),
                spheres.spheres[0], hit))
          continue;
      } else {
        const Hit own = closest_hit<Policies>(triangles.view(), local);
        if (!own.found() || k == 1) continue;
        hit.t = own.t;
      }
      nearest = std::min(nearest, hit.t);
      ++count;
    }
    const hiprtHit hit =
        hiprtSceneTraversalClosest(scene, ray, hiprtFullRayMask, hiprtTraversalHintDefault, &program, table.handle())
            .getNextHit();
    REQUIRE(hit.hasHit() == (count != 0));
    if (count != 0) CHECK(hit.t == nearest);
    CHECK(all_hits(hiprtSceneTraversalAnyHit(scene, ray, hiprtFullRayMask, hiprtTraversalHintDefault, &program,
                                             table.handle()))
              .size() == count);
  }
  CHECK(filtered[0] > 10);
  CHECK(filtered[1] > 10);
}

TEST_CASE("a scene's closest hit keeps what it had found when the stack overflows") {
  INFO("seed " << kSeed);
  Random random(kSeed + 24);
  Forest forest(random, 2, 300, false);
  forest.build();
  const SceneView view = forest.view();
  unsigned with_hit = 0, overflows = 0;
  for (unsigned i = 0; i < 500; ++i) {
    CAPTURE(i);
    const hiprtRay ray = random_ray(random);
    OwnStack<24> stack;
    hiprtEmptyInstanceStack empty;
    hiprtSceneTraversalClosestCustomStack closest(scene_handle(&view), ray, stack, empty);
    const hiprtHit hit = closest.getNextHit();
    const auto own = own_hits<Own<1>>(view, own_ray(ray));
    if (closest.getCurrentState() == hiprtTraversalStateStackOverflow) {
      ++overflows;
      if (!hit.hasHit()) continue;
      ++with_hit;
      CHECK(std::any_of(own.begin(), own.end(), [&](const auto& other) {
        return other.t == hit.t && other.primitive == hit.primID && other.path.instance[0] == hit.instanceID;
      }));
    } else {
      CHECK(hit.hasHit() == !own.empty());
    }
  }
  CHECK(overflows > 10);
  CHECK(with_hit > 0);
}
