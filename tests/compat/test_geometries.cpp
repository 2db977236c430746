// HIPRT's classes Geom... on triangles, against this library's queries.

#include <tests/compat/scenes.h>

using namespace hiprt;
using namespace hiprt::test;

namespace {

/// The closest of all hits.
Hit closest_of(const std::vector<Hit>& hits) {
  Hit best;
  for (const Hit& hit : hits)
    if (!best.found() || hit.t < best.t || (hit.t == best.t && hit.primitive < best.primitive)) best = hit;
  return best;
}

void check_same(const hiprtHit& hit, const Hit& own, const Triangles& scene) {
  REQUIRE(hit.hasHit() == own.found());
  if (!own.found()) {
    CHECK(is_miss(hit));
    return;
  }
  CHECK(hit.primID == own.primitive);
  CHECK(hit.t == own.t);
  CHECK(hit.uv.x == own.u);
  CHECK(hit.uv.y == own.v);
  CHECK(hit.instanceID == hiprtInvalidValue);
  check_normal(hit, scene.normal(hit.primID));
}

template <class Closest> void check_closest(const Triangles& scene, const hiprtRay& ray, Closest&& traversal) {
  CHECK(traversal.getCurrentState() == hiprtTraversalStateInit);
  check_same(traversal.getNextHit(), closest_of(own_hits<Policies>(scene.view(), own_ray(ray))), scene);
  CHECK(traversal.getCurrentState() == hiprtTraversalStateFinished);
  CHECK(is_miss(traversal.getNextHit()));
}

template <class AnyHit> void check_any(const Triangles& scene, const hiprtRay& ray, AnyHit&& traversal) {
  auto expected = own_hits<Policies>(scene.view(), own_ray(ray));
  const bool splits = (scene.view().features & feature_bit(Feature::kSplitReferences)) != 0;
  const auto hits = all_hits(traversal);
  CHECK(traversal.getCurrentState() == hiprtTraversalStateFinished);
  CHECK(is_miss(traversal.getNextHit()));
  if (!splits) CHECK(hits.size() == expected.size());
  for (const hiprtHit& hit : hits) {
    const auto found =
        std::find_if(expected.begin(), expected.end(), [&](const Hit& own) { return own.primitive == hit.primID; });
    REQUIRE(found != expected.end());
    check_same(hit, *found, scene);
  }
  for (const Hit& own : expected)
    CHECK(std::any_of(hits.begin(), hits.end(), [&](const hiprtHit& hit) { return hit.primID == own.primitive; }));
}

}  // namespace

TEST_CASE("triangles of one geometry: the closest hit and all hits") {
  INFO("seed " << kSeed);
  Random random(kSeed);
  for (const build::Builder builder : {build::Builder::kSah, build::Builder::kLbvh, build::Builder::kHq}) {
    for (const unsigned count : {1u, 2u, 7u, 200u}) {
      const Triangles scene(random, count, {.builder = builder}, count > 50 ? 0.5f : 1.0f);
      const SceneView view = scene.view();
      const hiprtGeometry geometry = geometry_handle(&view);
      for (unsigned i = 0; i < 100; ++i) {
        hiprtRay ray = random_ray(random);
        if (i % 3 == 1) ray.minT = random.uniform_float(0, 1.5);
        if (i % 3 == 2) ray.maxT = random.uniform_float(0, 1.5);
        CAPTURE(count, i);
        OwnStack<256> own;
        hiprtPrivateStack private_stack;
        hiprtGlobalStack global_stack({}, {});
        hiprtDynamicStack dynamic_stack({}, {});
        check_closest(scene, ray, hiprtGeomTraversalClosest(geometry, ray));
        check_closest(scene, ray, hiprtGeomTraversalClosestCustomStack(geometry, ray, own));
        check_closest(scene, ray, hiprtGeomTraversalClosestCustomStack(geometry, ray, private_stack));
        check_closest(scene, ray, hiprtGeomCustomTraversalClosest(geometry, ray));
        check_any(scene, ray, hiprtGeomTraversalAnyHit(geometry, ray));
        check_any(scene, ray, hiprtGeomTraversalAnyHitCustomStack(geometry, ray, own));
        check_any(scene, ray, hiprtGeomTraversalAnyHitCustomStack(geometry, ray, global_stack));
        check_any(scene, ray, hiprtGeomTraversalAnyHitCustomStack(geometry, ray, dynamic_stack));
        check_any(scene, ray, hiprtGeomCustomTraversalAnyHit(geometry, ray, hiprtTraversalHintShadowRays));
        CHECK(own.resets == 2);
        CHECK(own.empty());
        if (count == 200) CHECK(own.deepest < 256);
      }
    }
  }
}

TEST_CASE("trap: both ends of a ray, and a negative minT") {
  const Triangles scene(Corners{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}});
  const SceneView view = scene.view();
  const auto hits = [&](float min_t, float max_t, float z = 0.0f) {
    const hiprtRay ray = make_ray({0.25f, 0.25f, z}, {0, 0, 1}, min_t, max_t);
    return hiprtGeomTraversalClosest(geometry_handle(&view), ray).getNextHit().hasHit();
  };
  CHECK(hits(1, 1));
  CHECK(hits(0, 1));
  CHECK_FALSE(hits(0, 0.999f));
  CHECK_FALSE(hits(1.001f, 5));
  CHECK_FALSE(hits(-5, 5, 2));  // A negative minT counts as 0.
  CHECK(hits(-5, 5));
}

TEST_CASE("trap: both sides of a triangle; the normal is not turned and not normalised") {
  const Triangles scene(Corners{{0, 0, 1}, {2, 0, 1}, {0, 3, 1}});
  const SceneView view = scene.view();
  for (const float side : {-1.0f, 1.0f}) {
    const hiprtRay ray = make_ray({0.25f, 0.25f, 1 - side}, {0, 0, side});
    const hiprtHit hit = hiprtGeomTraversalClosest(geometry_handle(&view), ray).getNextHit();
    REQUIRE(hit.hasHit());
    CHECK(hit.normal == hiprtFloat3{0, 0, 6});
    CHECK(hit.t == 1.0f);
    CHECK(hit.uv == hiprtFloat2{0.125f, 0.25f / 3});
  }
}

TEST_CASE("trap: the normal of a triangle of extreme size is not scaled") {
  for (const float size : {0x1p-60f, 0x1p60f}) {
    const Triangles scene(Corners{{0, 0, size}, {size, 0, size}, {0, size, size}});
    const SceneView view = scene.view();
    const hiprtRay ray = make_ray({size / 4, size / 4, 0}, {0, 0, size});
    const hiprtHit hit = hiprtGeomTraversalClosest(geometry_handle(&view), ray).getNextHit();
    REQUIRE(hit.hasHit());
    CHECK(hit.normal == hiprtFloat3{0, 0, size * size});
  }
}

TEST_CASE("a geometry with custom primitives has no hits for the classes of triangles") {
  const Spheres scene(Points{{{0, 0, 0}, 1}});
  const SceneView view = scene.view();
  CHECK(is_miss(hiprtGeomTraversalClosest(geometry_handle(&view), make_ray({0, 0, -2}, {0, 0, 1})).getNextHit()));
}

TEST_CASE("an empty geometry") {
  const Triangles scene(std::vector<build::Position>{});
  const SceneView view = scene.view();
  const hiprtRay ray = make_ray({0, 0, -2}, {0, 0, 1});
  CHECK(is_miss(hiprtGeomTraversalClosest(geometry_handle(&view), ray).getNextHit()));
  hiprtGeomTraversalAnyHit any(geometry_handle(&view), ray);
  CHECK(is_miss(any.getNextHit()));
  CHECK(any.getCurrentState() == hiprtTraversalStateFinished);
}

TEST_CASE("a stack that is too small: the state says so, and the hit is a miss") {
  INFO("seed " << kSeed);
  Random random(kSeed + 1);
  const Triangles scene(random, 500, {}, 0.5f);
  const SceneView view = scene.view();
  const hiprtGeometry geometry = geometry_handle(&view);
  unsigned overflows = 0, fits = 0;
  for (unsigned i = 0; i < 200; ++i) {
    CAPTURE(i);
    const hiprtRay ray = random_ray(random);
    OwnStack<7> stack;
    hiprtGeomTraversalClosestCustomStack closest(geometry, ray, stack);
    const hiprtHit hit = closest.getNextHit();
    if (closest.getCurrentState() == hiprtTraversalStateStackOverflow) {
      ++overflows;
      CHECK(is_miss(hit));
    } else {
      ++fits;
      check_same(hit, closest_of(own_hits<Policies>(view, own_ray(ray))), scene);
    }
    CHECK(is_miss(closest.getNextHit()));
    // Hits that were found before the overflow are right.
    hiprtGeomTraversalAnyHitCustomStack any(geometry, ray, stack);
    const auto expected = own_hits<Policies>(view, own_ray(ray));
    for (const hiprtHit& found : all_hits(any))
      CHECK(std::any_of(expected.begin(), expected.end(), [&](const Hit& own) { return own.t == found.t; }));
    CHECK(any.getCurrentState() != hiprtTraversalStateHit);
  }
  CHECK(overflows > 10);
  CHECK(fits > 10);
}
