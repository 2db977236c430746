// Intersect and filter functions: custom primitives, payloads, tables, and HIPRT's rules for t.

#include <tests/compat/scenes.h>

using namespace hiprt;
using namespace hiprt::test;

namespace {

/// A program whose geometry is spheres.
Program sphere_program(const Spheres& scene) {
  return {.intersect = [&scene](const Call& call, hiprtHit& hit) {
    return intersect_sphere(call.ray, scene.spheres[hit.primID], hit);
  }};
}

}  // namespace

TEST_CASE("custom primitives: the closest hit and all hits") {
  INFO("seed " << kSeed);
  Random random(kSeed + 2);
  for (const unsigned count : {1u, 2u, 9u, 300u}) {
    const Spheres scene(random, count);
    const SceneView view = scene.view();
    const hiprtGeometry geometry = geometry_handle(&view);
    Program program = sphere_program(scene);
    for (unsigned i = 0; i < 100; ++i) {
      CAPTURE(count, i);
      hiprtRay ray = random_ray(random);
      if (i % 3 == 1) ray.minT = random.uniform_float(0, 1.5);
      if (i % 3 == 2) ray.maxT = random.uniform_float(0, 1.5);
      std::vector<hiprtHit> expected;
      for (std::uint32_t k = 0; k < count; ++k) {
        hiprtHit hit;
        hit.primID = k;
        if (intersect_sphere(ray, scene.spheres[k], hit)) expected.push_back(hit);
      }
      const auto nearest = std::min_element(expected.begin(), expected.end(),
                                            [](const hiprtHit& a, const hiprtHit& b) { return a.t < b.t; });
      OwnStack<256> own;
      const auto check_closest = [&](auto&& traversal) {
        const hiprtHit hit = traversal.getNextHit();
        CHECK(traversal.getCurrentState() == hiprtTraversalStateFinished);
        REQUIRE(hit.hasHit() == !expected.empty());
        if (expected.empty()) {
          CHECK(is_miss(hit));
          return;
        }
        CHECK(hit.t == nearest->t);
        CHECK(hit.primID == nearest->primID);
        CHECK(hit.uv == nearest->uv);
        CHECK(hit.normal == nearest->normal);
      };
      check_closest(hiprtGeomCustomTraversalClosest(geometry, ray, hiprtTraversalHintDefault, &program));
      check_closest(
          hiprtGeomCustomTraversalClosestCustomStack(geometry, ray, own, hiprtTraversalHintDefault, &program));
      const auto check_any = [&](auto&& traversal) {
        std::vector<std::uint32_t> found, wanted;
        for (const hiprtHit& hit : all_hits(traversal)) found.push_back(hit.primID);
        for (const hiprtHit& hit : expected) wanted.push_back(hit.primID);
        std::sort(found.begin(), found.end());
        CHECK(found == wanted);
      };
      check_any(hiprtGeomCustomTraversalAnyHit(geometry, ray, hiprtTraversalHintDefault, &program));
      check_any(hiprtGeomCustomTraversalAnyHitCustomStack(geometry, ray, own, hiprtTraversalHintDefault, &program));
    }
  }
}

TEST_CASE("trap: an intersect function gets a fresh hit and the ray with the current limit") {
  const Spheres scene(Points{{{0, 0, 2}, 1}, {{0, 0, 6}, 1}, {{0, 0, 10}, 1}});
  const SceneView view = scene.view();
  const hiprtRay ray = make_ray({0, 0, 0}, {0, 0, 1}, 0.125f, 50);
  std::vector<float> limits;
  Program program;
  program.intersect = [&](const Call& call, hiprtHit& hit) {
    CHECK(hit.t == -1.0f);
    CHECK(hit.instanceID == hiprtInvalidValue);
    CHECK(hit.uv == hiprtFloat2{0, 0});
    CHECK(hit.normal == hiprtFloat3{0, 0, 0});
    CHECK(call.geom_type == hiprtInvalidValue);
    CHECK(call.ray_type == 3u);
    CHECK(call.header.numGeomTypes == 0u);
    CHECK(call.header.numRayTypes == 1u);
    CHECK(call.header.funcDataSets == nullptr);
    CHECK(call.ray.minT == 0.125f);
    CHECK(call.ray.direction == ray.direction);
    limits.push_back(call.ray.maxT);
    return intersect_sphere(call.ray, scene.spheres[hit.primID], hit);
  };
  const auto run = [&](auto&& traversal) {
    limits.clear();
    while (traversal.getNextHit().hasHit()) {
    }
    return limits;
  };
  const auto closest = run(
      hiprtGeomCustomTraversalClosest(geometry_handle(&view), ray, hiprtTraversalHintDefault, &program, nullptr, 3));
  CHECK(closest.front() == 50.0f);
  for (std::size_t i = 1; i < closest.size(); ++i) CHECK(closest[i] <= closest[i - 1]);
  // The limit of AnyHit does not shrink, and each primitive is asked once.
  CHECK(run(hiprtGeomCustomTraversalAnyHit(geometry_handle(&view), ray, hiprtTraversalHintDefault, &program, nullptr,
                                           3)) == std::vector<float>{50, 50, 50});
}

TEST_CASE("trap: a custom t is not clamped") {
  const Spheres scene(Points{{{0, 0, 2}, 1}, {{0, 0, 6}, 1}});
  const SceneView view = scene.view();
  const hiprtGeometry geometry = geometry_handle(&view);
  Program program;
  float reported = -1.0f;
  bool sets_t = false;
  unsigned calls = 0;
  program.intersect = [&](const Call&, hiprtHit& hit) {
    ++calls;
    if (sets_t) hit.t = reported;
    return true;
  };
  const hiprtRay ray = make_ray({0, 0, 0}, {0, 0, 1}, 0.5f, 20);
  const auto closest = [&] {
    calls = 0;
    return hiprtGeomCustomTraversalClosest(geometry, ray, hiprtTraversalHintDefault, &program).getNextHit();
  };
  SECTION("never set: t = -1 cuts the ray there") {
    const hiprtHit hit = closest();
    CHECK(hit.hasHit());
    CHECK(hit.t == -1.0f);
    CHECK(calls == 1);
  }
  sets_t = true;
  SECTION("behind the ray's origin") {
    reported = -3.0f;
    CHECK(closest().t == -3.0f);
    CHECK(calls == 1);
  }
  SECTION("before minT") {
    reported = 0.25f;
    CHECK(closest().t == 0.25f);
  }
  SECTION("beyond maxT: the limit grows") {
    reported = 100.0f;
    const hiprtHit hit = closest();
    CHECK(hit.t == 100.0f);
    CHECK(calls == 2);
  }
  SECTION("infinite and NaN") {
    for (const float t : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
      reported = t;
      CHECK(closest().hasHit());
    }
  }
  for (const float t : {-3.0f, 0.25f, 100.0f}) {
    reported = t;
    const auto hits = all_hits(hiprtGeomCustomTraversalAnyHit(geometry, ray, hiprtTraversalHintDefault, &program));
    REQUIRE(hits.size() == 2);
    for (const hiprtHit& hit : hits) CHECK(hit.t == t);
  }
}

TEST_CASE("trap: boxes are tested between 0 and maxT, whatever minT is") {
  const Spheres scene(Points{{{0, 0, 2}, 1}});
  const SceneView view = scene.view();
  unsigned calls = 0;
  Program program;
  program.intersect = [&](const Call&, hiprtHit&) { return ++calls == 0; };
  const auto calls_of = [&](const hiprtRay& ray) {
    calls = 0;
    hiprtGeomCustomTraversalClosest(geometry_handle(&view), ray, hiprtTraversalHintDefault, &program).getNextHit();
    return calls;
  };
  CHECK(calls_of(make_ray({0, 0, 0}, {0, 0, 1}, 5, 9)) == 1);
  CHECK(calls_of(make_ray({0, 0, 0}, {0, 0, 1}, 9, 5)) == 1);
  CHECK(calls_of(make_ray({0, 0, 0}, {0, 0, 1}, 0, 0.5f)) == 0);
  CHECK(calls_of(make_ray({0, 0, 0}, {0, 0, -1})) == 0);
}

TEST_CASE("trap: neighbours by minT = maxT = 0, and t as the squared distance") {
  INFO("seed " << kSeed);
  Random random(kSeed + 3);
  const float radius = 0.25f;
  Spheres scene(random, 500, radius, radius);
  const SceneView view = scene.view();
  Program program;
  for (unsigned i = 0; i < 200; ++i) {
    CAPTURE(i);
    const auto p = random.in_cube(1.0);
    const hiprtRay ray = make_ray({p[0], p[1], p[2]}, {0, 0, 1}, 0, 0);
    const auto offset = [&](std::uint32_t k) {
      return hiprtFloat3{scene.spheres[k].position[0], scene.spheres[k].position[1], scene.spheres[k].position[2]} -
             ray.origin;
    };
    program.intersect = [&](const Call& call, hiprtHit& hit) {
      CHECK(call.ray.maxT == 0.0f);
      hit.normal = offset(hit.primID);
      hit.t = dot(hit.normal, hit.normal);
      return hit.t < radius * radius;
    };
    std::vector<std::uint32_t> found, expected;
    for (const hiprtHit& hit :
         all_hits(hiprtGeomCustomTraversalAnyHit(geometry_handle(&view), ray, hiprtTraversalHintDefault, &program))) {
      CHECK(hit.normal == offset(hit.primID));
      CHECK(hit.t == dot(hit.normal, hit.normal));
      found.push_back(hit.primID);
    }
    for (std::uint32_t k = 0; k < 500; ++k)
      if (dot(offset(k), offset(k)) < radius * radius) expected.push_back(k);
    std::sort(found.begin(), found.end());
    CHECK(found == expected);
  }
}

TEST_CASE("trap: functions that refuse everything see each candidate once, and may record it") {
  INFO("seed " << kSeed);
  Random random(kSeed + 4);
  const Spheres spheres(random, 100);
  const Triangles triangles(random, 100, {}, 1.0f);
  set_type(triangles.view(), 0);
  const SceneView sphere_view = spheres.view(), triangle_view = triangles.view();
  Table table(1, 1);
  for (unsigned i = 0; i < 50; ++i) {
    CAPTURE(i);
    const hiprtRay ray = random_ray(random);
    std::vector<std::uint32_t> seen;
    Program program;
    program.intersect = [&](const Call&, hiprtHit& hit) {
      seen.push_back(hit.primID);
      return false;
    };
    program.filter = [&](const Call&, const hiprtHit& hit) {
      seen.push_back(hit.primID);
      return true;
    };
    CHECK(
        is_miss(hiprtGeomCustomTraversalAnyHit(geometry_handle(&sphere_view), ray, hiprtTraversalHintDefault, &program)
                    .getNextHit()));
    std::sort(seen.begin(), seen.end());
    CHECK(std::adjacent_find(seen.begin(), seen.end()) == seen.end());
    for (std::uint32_t k = 0; k < 100; ++k) {
      hiprtHit hit;
      if (intersect_sphere(ray, spheres.spheres[k], hit)) CHECK(std::binary_search(seen.begin(), seen.end(), k));
    }
    seen.clear();
    CHECK(is_miss(hiprtGeomTraversalClosest(geometry_handle(&triangle_view), ray, hiprtTraversalHintDefault, &program,
                                            table.handle())
                      .getNextHit()));
    CHECK(seen.size() == own_hits<Policies>(triangle_view, own_ray(ray)).size());
  }
}

TEST_CASE("trap: an intersect function may change primID") {
  const Spheres scene(Points{{{0, 0, 2}, 1}, {{0, 0, 6}, 1}});
  const SceneView view = scene.view();
  Program program;
  for (const std::uint32_t number : {0u, 7u, 0x7fc00001u, 0xfffffffeu}) {
    program.intersect = [&](const Call& call, hiprtHit& hit) {
      if (!intersect_sphere(call.ray, scene.spheres[hit.primID], hit)) return false;
      hit.primID = number;
      return true;
    };
    const hiprtRay ray = make_ray({0, 0, 0}, {0, 0, 1});
    CHECK(hiprtGeomCustomTraversalClosest(geometry_handle(&view), ray, hiprtTraversalHintDefault, &program)
              .getNextHit()
              .primID == number);
    const auto hits =
        all_hits(hiprtGeomCustomTraversalAnyHit(geometry_handle(&view), ray, hiprtTraversalHintDefault, &program));
    REQUIRE(hits.size() == 2);
    CHECK(hits[1].primID == number);
  }
}

TEST_CASE("a stateful function is asked once per primitive also when the traversal stops and continues") {
  INFO("seed " << kSeed);
  Random random(kSeed + 5);
  const Spheres scene(random, 200, 0.3, 0.6);
  set_type(scene.view(), 0);
  const SceneView view = scene.view();
  Table table(1, 1);
  for (unsigned i = 0; i < 50; ++i) {
    CAPTURE(i);
    const hiprtRay ray = random_ray(random);
    std::vector<unsigned> calls(200), filtered(200);
    Program program = sphere_program(scene);
    const auto plain = program.intersect;
    program.intersect = [&](const Call& call, hiprtHit& hit) {
      ++calls[hit.primID];
      return plain(call, hit);
    };
    program.filter = [&](const Call&, const hiprtHit& hit) { return ++filtered[hit.primID] > 1; };
    const auto hits = all_hits(hiprtGeomCustomTraversalAnyHit(geometry_handle(&view), ray, hiprtTraversalHintDefault,
                                                              &program, table.handle()));
    std::size_t expected = 0;
    for (std::uint32_t k = 0; k < 200; ++k) {
      hiprtHit hit;
      expected += intersect_sphere(ray, scene.spheres[k], hit) ? 1 : 0;
      CHECK(calls[k] <= 1);
      CHECK(filtered[k] <= 1);
    }
    CHECK(hits.size() == expected);
  }
}
